"""Round values for the numbers at an axis, and as many digits of a value as say something."""

from __future__ import annotations

import math

_TICKS = 5
_DIGITS = 3
_MOST_DECIMALS = 6


def ticks_of(low: float, high: float, *, is_log: bool = False) -> list[float]:
    """Round values for the numbers at an axis.

    Args:
        low: Where it begins.
        high: Where it ends, above.
        is_log: Whether equal distances are equal ratios.
    """
    if is_log and high >= 3.0 * low:
        decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
        for steps in ((1, 2, 5), (1, 3), (1,)):
            values = [step * 10.0**decade for decade in decades for step in steps]
            inside = [value for value in values if low <= value <= high]
            if len(inside) <= _TICKS + 2:
                break
        return inside
    step = _round_step((high - low) / _TICKS)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [place * step for place in range(first, last + 1)]


def _round_step(least: float) -> float:
    power = 10.0 ** math.floor(math.log10(least))
    return min(f * power for f in (1.0, 2.0, 2.5, 5.0, 10.0) if f * power >= least * (1 - 1e-9))


def digits_of(value: float, scale: float, *, signed: bool = False) -> str:
    """A value with the digits that matter beside others: to a thousandth of the largest.

    So what is nothing but rounding reads as 0.000 where its neighbours are about 1.

    Args:
        value: The value.
        scale: The largest absolute value among those it stands with.
        signed: Whether a plus stands before what is positive.
    """
    plus = "+" if signed else ""
    if not math.isfinite(value):
        return "–"
    power = math.floor(math.log10(scale)) if 0.0 < scale < math.inf else 0
    decimals = max(_DIGITS - power, 0)
    if decimals > _MOST_DECIMALS + _DIGITS or power > _MOST_DECIMALS:
        return f"{value:{plus}.{_DIGITS}e}"
    return f"{round(value, decimals) + 0.0:{plus}.{decimals}f}"
