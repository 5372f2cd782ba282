"""Ranges and steps of sliders."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from slipgrasp.core.scenario.parameters import Parameter

_STEPS_PER_SLIDER = 200


class SliderRange(NamedTuple):
    """Range of a slider, in the unit of its parameter."""

    low: float
    high: float
    step: float


def slider_range(
    parameter: Parameter, definitions: Mapping[str, Parameter], value: float
) -> SliderRange:
    """The range of a slider: the typical range, extended to include its values.

    Args:
        parameter: A number. An estimate has the typical range of its parameter.
        definitions: Every parameter of the scenario by key.
        value: Another value to include.
    """
    first = parameter.value if isinstance(parameter.value, float) else value
    typical = parameter.typical or _estimated(parameter, definitions)
    start, end = typical or (min(0.5 * first, 2.0 * first), max(0.5 * first, 2.0 * first))
    low, high = min(start, first, value), max(end, first, value)
    if high <= low:
        high = low + 1.0
    return SliderRange(low, high, round_step((end - start) or (high - low)))


def _estimated(
    parameter: Parameter, definitions: Mapping[str, Parameter]
) -> tuple[float, float] | None:
    """The typical range of the parameter that this one estimates."""
    sibling = definitions.get(f"{parameter.key.rpartition('.')[0]}.parameter")
    target = definitions.get(str(sibling.value)) if sibling else None
    return target.typical if target else None


def round_step(length: float) -> float:
    """The step of a slider: 1, 2 or 5 times a power of ten."""
    step = length / _STEPS_PER_SLIDER
    power = 10.0 ** math.floor(math.log10(step))
    return max(power * factor for factor in (1.0, 2.0, 5.0) if power * factor <= step * (1 + 1e-9))
