"""Random scenarios in pairs: all levels meet, and whatever can be set is varied."""

from collections import defaultdict
from fnmatch import fnmatchcase
from itertools import pairwise

import pytest

from slipgrasp.core.scenario.parameters import describe
from slipgrasp.core.scenario.scenario import full_scenario
from slipgrasp.core.scenario.space import SPACES
from tests.core.covering_array import missing_pairs
from tests.core.drawn_draft import changeable
from tests.core.drawn_levels import (
    APART,
    RANGES,
    TOGETHER,
    pattern_of,
)
from tests.core.drawn_pairs import BLOCK, draw_in_pairs, draw_levels, factors, rows_of_block, sizes

pytestmark = pytest.mark.slow

PLANE_AND_SPACE = pytest.mark.parametrize("in_space", [False, True])
# What stays the same in all draws: words, a bound on the cost, and what space does not compute.
SAME = {False: {"title", "simulation.max_steps", "fingers.*.kind"}}
SAME[True] = {*SAME[False], "controller.link_length_ratio", "controller.recognition_time"}


@pytest.fixture(scope="module")
def drawn():
    """The scenarios of one block, by whether they are in space."""
    return {where: [draw_in_pairs(3, i, where) for i in range(BLOCK)] for where in (False, True)}


@pytest.fixture(scope="module")
def described(drawn):
    """The parameters of a third of them, by the names of their factors."""
    return {
        where: [
            (pattern_of(key), parameter)
            for each in drawn[where][::3]
            for key, parameter in describe(each.scenario).items()
        ]
        for where in (False, True)
    }


def is_refused(in_space, levels):
    """Whether validation refuses levels with which all else is at its first level."""
    row = [0] * len(factors(in_space))
    for factor, level in levels:
        row[factor] = level
    return draw_levels(in_space, tuple(row), "alone") is None


# Draws


@PLANE_AND_SPACE
def test_every_two_levels_meet_within_1000_runs_unless_validation_refuses_them(drawn, in_space):
    missing = missing_pairs(sizes(in_space), [each.row for each in drawn[in_space]])
    alone = {level for level in set().union(*missing) if is_refused(in_space, [level])}
    pairs = [pair for pair in missing if not pair & alone]
    left = [pair for pair in pairs if not is_refused(in_space, pair)]
    assert len(alone) <= 10
    assert len(pairs) < 100  # of some 70 000
    assert len(left) < 20
    # Rows that had to be changed; the next block has others.
    for pair in left:
        rows = enumerate(rows_of_block(in_space, "3 1"))
        with_pair = [k for k, row in rows if pair <= set(enumerate(row))]
        later = (draw_in_pairs(3, BLOCK + k, in_space).row for k in with_pair)
        assert any(pair <= set(enumerate(row)) for row in later)


@PLANE_AND_SPACE
def test_whatever_can_be_set_takes_several_values(described, in_space):
    found = defaultdict(set)
    for name, parameter in described[in_space]:
        found[name].add(parameter.value)
    definitions = {pattern_of(key) for key in describe(full_scenario(SPACES[in_space]))}
    same = {name for name in definitions if len(found[name]) < 2}
    apart = {name for name in same if any(fnmatchcase(name, each) for each in APART)}
    assert same - apart == SAME[in_space]


@PLANE_AND_SPACE
def test_numbers_are_drawn_at_both_ends_of_the_range_of_their_slider(described, in_space):
    found, typical = defaultdict(set), {}
    for name, parameter in described[in_space]:
        if isinstance(parameter.value, float) and parameter.typical is not None:
            found[name].add(parameter.value)
            typical[name] = parameter.typical
    bare = typical.keys() - RANGES.keys() - SAME[in_space]
    assert len(bare) > 30
    for name in bare - set(TOGETHER):
        low, high = typical[name]
        assert {low, high} <= found[name], name
        assert any(low < value < high for value in found[name]), name


@PLANE_AND_SPACE
def test_every_parameter_that_may_change_does_so_in_some_run(drawn, in_space):
    changed = {
        pattern_of(change.parameter) for each in drawn[in_space] for change in each.scenario.changes
    }
    assert changed == set(changeable(in_space)) - SAME[in_space]


@PLANE_AND_SPACE
def test_events_happen_at_equal_times_on_ticks_and_just_beside(drawn, in_space):
    equal = close = on_ticks = 0
    for each in drawn[in_space]:
        scenario = each.scenario
        times = sorted(event.time for event in (*scenario.changes, *scenario.pulses))
        gaps = [b - a for a, b in pairwise(times)]
        equal += any(gap == 0.0 for gap in gaps)
        close += any(0.0 < gap < 1e-8 for gap in gaps)
        period = scenario.controller.control_period
        on_ticks += any(period and round(time / period) * period == time for time in times)
    assert min(equal, close, on_ticks) > 0.02 * len(drawn[in_space])


# New parameters
