"""Presets, and the parameters of a scenario with their bounds."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, HTTPException, Query

from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.loading import all_preset_names, preset_names
from slipgrasp.server.http.errors import ProblemPublic
from slipgrasp.server.runs.scenarios import (
    ParametersPublic,
    PresetPublic,
    PresetsPublic,
    PresetSummary,
    find_preset,
)

router = APIRouter(tags=["scenarios"])


@router.get("/presets")
def list_presets() -> PresetsPublic:
    """The built-in scenarios."""
    data = [PresetSummary.from_name(name) for name in all_preset_names()]
    return PresetsPublic(data=data, count=len(data))


@router.get("/presets/{name}", responses=ProblemPublic.responses((404,)))
def read_preset(name: str) -> PresetPublic:
    """A preset with its complete scenario, ready to be edited and posted."""
    if name not in all_preset_names():
        raise HTTPException(404)
    summary = PresetSummary.from_name(name)
    return PresetPublic(**summary.model_dump(), scenario=find_preset(name).to_mapping())


@router.get("/parameters", responses=ProblemPublic.responses((422,)))
def list_parameters(
    preset: Annotated[
        str,
        Query(
            max_length=200, description="preset whose fingers, estimates and values are described"
        ),
    ] = preset_names()[0],
    law: Annotated[
        str | None,
        Query(
            max_length=200,
            description="control law to use instead of the preset's, including custom ones",
        ),
    ] = None,
) -> ParametersPublic:
    """Every parameter: key, unit, bounds, choices, a description, and its value in a preset."""
    scenario = find_preset(preset)
    return ParametersPublic.from_scenario(scenario if law is None else with_law(scenario, law))
