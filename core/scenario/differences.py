"""Which parameters of two scenarios differ."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import parameter_definitions

ParameterValue = float | int | str | tuple[float, ...] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ParameterDifference:
    """A parameter of the scenario that differs.

    Attributes:
        key: Its dotted key.
        a: Its value in the first run, None if it has none.
        b: Its value in the second run.
        unit: SI unit.
    """

    key: str
    a: ParameterValue
    b: ParameterValue
    unit: str


def parameter_differences(a: Scenario, b: Scenario) -> Iterator[ParameterDifference]:
    """The parameters of two scenarios that differ, in the order of the fields."""
    mine, others = parameter_definitions(a), parameter_definitions(b)
    for key in dict.fromkeys((*mine, *others)):
        values = [known[key].value if key in known else None for known in (mine, others)]
        if values[0] != values[1]:
            unit = (mine.get(key) or others[key]).unit
            yield ParameterDifference(key=key, a=values[0], b=values[1], unit=unit)
