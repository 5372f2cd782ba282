"""What the REST interface takes: a request for a run."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.field_errors import nearest
from slipgrasp.core.scenario.loading import (
    load_scenario,
    preset_names,
    scenario_from_mapping,
    with_values,
)
from slipgrasp.server.exceptions import printable


class RunCreate(BaseModel):
    """What to simulate: a preset by name or a whole scenario, and what to change in it."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        json_schema_extra={
            "example": {"scenario": "paper-case-1", "set": {"object.mass": 1.4}},
        },
    )

    scenario: Annotated[
        str | dict[str, Any],
        Field(description="Name of a preset, or a scenario as GET /presets/NAME gives one."),
    ]
    values: Annotated[
        dict[str, Any],
        Field(alias="set", description="Dotted key to value; GET /parameters lists the keys."),
    ] = {}

    def to_scenario(self) -> Scenario:
        """The scenario that is asked for.

        Raises:
            ScenarioError: With one entry per wrong field.
        """
        if isinstance(self.scenario, dict):
            base = scenario_from_mapping(self.scenario)
        else:
            base = find_preset(self.scenario)
        return with_values(base, self.values) if self.values else base


def find_preset(name: str) -> Scenario:
    """The scenario of a preset; a path is no name here, unlike on the command line.

    Raises:
        ScenarioError: If there is none of that name.
    """
    known = preset_names()
    if name in known:
        return load_scenario(name)
    shown = printable(name)
    message = f"there is no preset '{shown}'{nearest(name, known)}"
    limit = f"one of {', '.join(known)}"
    raise ScenarioError([FieldError(field="scenario", value=shown, limit=limit, message=message)])
