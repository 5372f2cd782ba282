"""Scenarios that differ in one number, over a range of its values."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.field_errors import single_error, unknown_key
from slipgrasp.core.scenario.loading import parameter_definitions
from slipgrasp.core.scenario.parameters import Parameter
from slipgrasp.core.study.definition import apply_values, expand_key


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterRange:
    """A scenario in which one number varies over a range.

    Attributes:
        scenario: The scenario.
        key: Dotted key of the number; ``fingers.*.friction`` sets all fingers equally.
        unit: Its SI unit, "1" for pure numbers.
        whole: Whether it takes integers only.
        start: First end of the range.
        stop: Other end, larger or smaller.
    """

    scenario: Scenario
    key: str
    unit: str
    whole: bool
    start: float
    stop: float

    @classmethod
    def of(cls, scenario: Scenario, key: str, start: float, stop: float) -> Self:
        """Creates the range; its ends are rounded for an integer parameter.

        Raises:
            ScenarioError: If the parameter does not exist, or a value is not allowed.
        """
        parameter = _find_number(scenario, key)
        whole = parameter.kind == "integer"
        if not (math.isfinite(start) and math.isfinite(stop)):
            raise _no_range(key, start, stop, "two finite numbers")
        start, stop = (round(end) if whole else float(end) for end in (start, stop))
        if start == stop:
            raise _no_range(key, start, stop, "two different values")
        found = cls(
            scenario=scenario, key=key, unit=parameter.unit, whole=whole, start=start, stop=stop
        )
        for end in (start, stop):
            found.scenario_at(end)
        return found

    @property
    def width(self) -> float:
        """Distance between the ends."""
        return abs(self.stop - self.start)

    def divided(self, steps: int) -> list[float]:
        """Evenly spaced values from start to stop, or fewer integers."""
        inner = (self.between(self.start, self.stop, k / steps) for k in range(1, steps))
        return list(dict.fromkeys((self.start, *inner, self.stop)))

    def between(self, a: float, b: float, share: float = 0.5) -> float:
        """The value at a fraction of the way between two values; one of them if none is between."""
        value = a + (b - a) * share
        return round(value) if self.whole else value

    def scenario_at(self, value: float) -> Scenario:
        """The scenario at a value.

        Raises:
            ScenarioError: If the value is not allowed.
        """
        return apply_values(self.scenario, {self.key: value})


def _find_number(scenario: Scenario, key: str) -> Parameter:
    definitions = parameter_definitions(scenario)
    keys = expand_key(scenario, key)
    unknown = next((one for one in keys if one not in definitions), None)
    if unknown is not None:
        raise ScenarioError([unknown_key(scenario, unknown)])
    parameter = definitions[keys[0]]
    if parameter.kind not in ("number", "integer", "number-or-list"):
        message = (
            f"{key} is a {parameter.kind}, which has no range; choose a number such as object.mass"
        )
        raise ScenarioError([FieldError(field=key, value=None, limit="a number", message=message)])
    return parameter


def _no_range(key: str, start: float, stop: float, needed: str) -> ScenarioError:
    message = f"{key} from {start:g} to {stop:g} is not a range; give {needed}"
    return single_error(key, start, needed, message)
