"""Result of a fit for a parameter, in words."""

from __future__ import annotations

from collections.abc import Sequence

from slipgrasp.core.words.parameter_words import unit_after


def interval_words(
    kind: str,
    value: float | None,
    low: float | None,
    high: float | None,
    unit: str,
    limits: Sequence[float],
) -> str:
    """The estimate with its 95 % interval, or the sides on which the data bound it.

    Args:
        kind: Which sides the data bound, a class of a fitted parameter.
        value: The estimate; None unless they bound both sides.
        low: Lower end of the interval, if bounded.
        high: Upper end of the interval, if bounded.
        unit: Its SI unit.
        limits: Lower and upper end of the searched range.
    """
    after = unit_after(unit)
    number, least, most = ("" if each is None else f"{each:.6g}" for each in (value, low, high))
    searched = f"in the searched range {limits[0]:.6g} … {limits[1]:.6g}{after}"
    return {
        "bounded": f"{number}{after}, 95 % interval {least} … {most}{after}",
        "only above": f"at most {most}{after}; not bounded below {searched}",
        "only below": f"at least {least}{after}; not bounded above {searched}",
        "flat": f"not bounded {searched}",
    }[kind]
