"""Result of a fit for a parameter, in words."""

from __future__ import annotations

from slipgrasp.core.words.parameter_words import unit_after


def interval_words(
    kind: str, value: float | None, low: float | None, high: float | None, unit: str
) -> str:
    """The estimate with its 95 % interval, or the sides on which the data bound it.

    Args:
        kind: Which sides the data bound, a class of a fitted parameter.
        value: The estimate; None unless they bound both sides.
        low: Lower end of the interval, if bounded.
        high: Upper end of the interval, if bounded.
        unit: Its SI unit.
    """
    after = unit_after(unit)
    number, least, most = ("" if each is None else f"{each:.6g}" for each in (value, low, high))
    return {
        "bounded": f"{number}{after}, 95 % interval {least} … {most}{after}",
        "only above": f"at most {most}{after}; the data do not bound it below",
        "only below": f"at least {least}{after}; the data do not bound it above",
        "flat": "the data do not bound it",
    }[kind]
