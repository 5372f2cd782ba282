"""Round values for ticks of an axis, and significant digits of values."""

from __future__ import annotations

import math

_TICKS = 5
_DIGITS = 3
_MOST_DECIMALS = 6


def ticks_of(low: float, high: float, *, is_log: bool = False) -> list[float]:
    """Round values for ticks of an axis.

    Args:
        low: Lower limit.
        high: Upper limit.
        is_log: Whether the scale is logarithmic.
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
    """Formats a value with digits down to a thousandth of the largest one.

    Rounding errors therefore appear as 0.000 next to values of about 1.

    Args:
        value: The value.
        scale: The largest absolute value in the group.
        signed: Whether to include a plus sign.
    """
    plus = "+" if signed else ""
    if not math.isfinite(value):
        return "–"
    power = math.floor(math.log10(scale)) if 0.0 < scale < math.inf else 0
    decimals = max(_DIGITS - power, 0)
    if decimals > _MOST_DECIMALS + _DIGITS or power > _MOST_DECIMALS:
        return f"{value:{plus}.{_DIGITS}e}"
    return f"{round(value, decimals) + 0.0:{plus}.{decimals}f}"
