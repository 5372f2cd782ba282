"""Which of the parameters that a study varies span its map, and which are held side by side."""

from __future__ import annotations

import math

from slipgrasp.core.scenario.parameters import Parameter, describe
from slipgrasp.core.study.definition import Study, expand_key

MOST_COMBINATIONS = 16
"""Of more, no table and no row of panels could be read."""

_FEWEST_FOR_AN_AXIS = 3


def numeric_keys(study: Study) -> tuple[str, ...]:
    """The varied keys whose values are numbers in every run, in the study's order."""
    ranges = {axis.key for axis in study.axes if axis.is_range}
    return tuple(
        key for key in study.keys if key in ranges or all(map(_is_number, _values(study, key)))
    )


def choose_axes(study: Study) -> tuple[str, str] | None:
    """The two keys that a map of the study is drawn over, None if there are no two.

    Ranges come first, then values that are crossed or listed, of which there must be
    three: two values of a setting are rather compared side by side.
    """
    ranges = {axis.key for axis in study.axes if axis.is_range}
    numeric = [
        key for key in numeric_keys(study) if _num_values(study, key) >= _least(key in ranges)
    ]
    chosen = sorted(numeric, key=lambda key: key not in ranges)
    if len(chosen) < 2:
        return None
    x, y = sorted(chosen[:2], key=study.keys.index)
    return x, y


def compared_keys(study: Study, shown: tuple[str, ...] | None = None) -> tuple[str, ...]:
    """The keys whose values are tried on the same samples, to be held side by side.

    Args:
        study: The study.
        shown: Keys that are shown otherwise; those of the map if None.

    Returns:
        The keys; none if they have more combinations than can be looked at together.
    """
    hidden = (choose_axes(study) or ()) if shown is None else shown
    axes = [axis for axis in study.axes if not axis.is_range and axis.key not in hidden]
    axes = [axis for axis in axes if axis.grid_size > 1]
    if math.prod(axis.grid_size for axis in axes) > MOST_COMBINATIONS:
        return ()
    return tuple(axis.key for axis in axes)


def parameter_of(study: Study, key: str) -> Parameter | None:
    """What a varied key sets: the first of its parameters, None where the base lacks it."""
    return describe(study.base).get(expand_key(study.base, key)[0])


def _least(is_range: bool) -> int:
    return 2 if is_range else _FEWEST_FOR_AN_AXIS


def _num_values(study: Study, key: str) -> float:
    """How many values a key takes, without end where a range is sampled."""
    for axis in study.axes:
        if axis.key == key and axis.is_range:
            return axis.grid_size if study.sampling.method == "grid" else math.inf
    return len(set(_values(study, key)))


def _values(study: Study, key: str) -> list[object]:
    """What a key that is not a range is set to, in any run."""
    for axis in study.axes:
        if axis.key == key:
            return list(axis.values or ())
    return [run.get(key) for run in study.listed]


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
