"""Parameters of a study for the axes of its map, and for comparison side by side."""

from __future__ import annotations

import math

from slipgrasp.core.scenario.parameters import Parameter, describe
from slipgrasp.core.study.definition import Study, expand_key

MOST_COMBINATIONS = 16
"""Largest number of combinations in a readable table or row of panels."""

_FEWEST_FOR_AN_AXIS = 3


def numeric_keys(study: Study) -> tuple[str, ...]:
    """Varied keys with numeric values in every run, in the study's order."""
    ranges = {axis.key for axis in study.axes if axis.is_range}
    return tuple(
        key for key in study.keys if key in ranges or all(map(is_number, _values(study, key)))
    )


def choose_axes(study: Study) -> tuple[str, str] | None:
    """The two keys of the axes of a map, None if there are none.

    Ranges come first, then combined or listed values, of which there must be three: two values are
    compared side by side instead.
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
    """The keys whose values are combined with the same samples, for comparison side by side.

    Args:
        study: The study.
        shown: Keys to exclude; those of the map if None.

    Returns:
        The keys; none if they have too many combinations.
    """
    hidden = (choose_axes(study) or ()) if shown is None else shown
    axes = [axis for axis in study.axes if not axis.is_range and axis.key not in hidden]
    axes = [axis for axis in axes if axis.grid_size > 1]
    if math.prod(axis.grid_size for axis in axes) > MOST_COMBINATIONS:
        return ()
    return tuple(axis.key for axis in axes)


def parameter_of(study: Study, key: str) -> Parameter | None:
    """The first parameter of a varied key, None if the base lacks it."""
    return describe(study.base).get(expand_key(study.base, key)[0])


def _least(is_range: bool) -> int:
    return 2 if is_range else _FEWEST_FOR_AN_AXIS


def _num_values(study: Study, key: str) -> float:
    """The number of values of a key, infinite for a sampled range."""
    for axis in study.axes:
        if axis.key == key and axis.is_range:
            return axis.grid_size if study.sampling.method == "grid" else math.inf
    return len(set(_values(study, key)))


def _values(study: Study, key: str) -> list[object]:
    """The values of a key that is not a range, over all runs."""
    for axis in study.axes:
        if axis.key == key:
            return list(axis.values or ())
    return [run.get(key) for run in study.listed]


def is_number(value: object) -> bool:
    """Whether a value is a number, not a Boolean."""
    return isinstance(value, (int, float)) and not isinstance(value, bool)
