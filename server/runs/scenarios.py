"""REST models of scenarios, presets, and parameters with their bounds."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, Field

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.field_errors import nearest
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.loading import (
    all_preset_names,
    load_scenario,
    scenario_from_mapping,
    settable_parameters,
    with_values,
)
from slipgrasp.core.scenario.parameters import Parameter
from slipgrasp.server.addresses import preset_path
from slipgrasp.server.exceptions import printable

ChosenScenario = Annotated[
    str | dict[str, Any],
    Field(description="Name of a preset, or a scenario as from GET /presets/NAME."),
]
ChangedValues = Annotated[
    dict[str, Any],
    Field(alias="set", description="Dotted key to value; GET /parameters lists the keys."),
]


def changed_scenario(
    chosen: str | dict[str, Any], values: dict[str, Any], law: str | None = None
) -> Scenario:
    """The scenario that a request chooses, with changed values.

    Args:
        chosen: Name of a preset, or a complete scenario.
        values: Dotted key to value.
        law: Control law to use, with recommended settings, before the values.

    Raises:
        ScenarioError: With one item per wrong field.
    """
    base = scenario_from_mapping(chosen) if isinstance(chosen, dict) else find_preset(chosen)
    if law is not None:
        base = with_law(base, law)
    return with_values(base, values) if values else base


class PresetSummary(BaseModel):
    """A preset."""

    name: str
    title: str
    links: dict[str, str]

    @classmethod
    def from_name(cls, name: str) -> Self:
        """Returns the summary of a preset."""
        links = {"self": preset_path(name)}
        return cls(name=name, title=load_scenario(name).title, links=links)


class PresetsPublic(BaseModel):
    """All presets."""

    data: list[PresetSummary]
    count: int


class PresetPublic(PresetSummary):
    """A preset with its scenario, in the form of ``POST /runs``."""

    scenario: dict[str, Any]


class ParameterPublic(BaseModel):
    """A parameter of a scenario: meaning and allowed values."""

    key: str
    value: bool | float | int | str | list[float] | None
    kind: Literal["number", "integer", "boolean", "choice", "text", "number-or-list"]
    unit: str
    text: str
    limit: str
    minimum: float | None
    maximum: float | None
    exclusive_minimum: bool
    typical: tuple[float, float] | None
    choices: list[str]
    optional: bool
    changeable: bool

    @classmethod
    def from_parameter(cls, parameter: Parameter) -> Self:
        """Converts a parameter to its response."""
        return cls.model_validate(parameter, from_attributes=True)


class ParametersPublic(BaseModel):
    """The parameters of a preset by dotted key, list items by index."""

    data: list[ParameterPublic]
    count: int

    @classmethod
    def from_scenario(cls, scenario: Scenario) -> Self:
        """All parameters; of an empty list, those of one item, without values."""
        definitions = settable_parameters(scenario).values()
        data = [ParameterPublic.from_parameter(parameter) for parameter in definitions]
        return cls(data=data, count=len(data))


def find_preset(name: str) -> Scenario:
    """The scenario of a preset; paths are not allowed, unlike on the command line.

    Raises:
        ScenarioError: If the preset does not exist.
    """
    known = all_preset_names()
    if name in known:
        return load_scenario(name)
    shown = printable(name)
    message = f"there is no preset '{shown}'{nearest(name, known)}"
    limit = f"one of {', '.join(known)}"
    raise ScenarioError([FieldError(field="scenario", value=shown, limit=limit, message=message)])
