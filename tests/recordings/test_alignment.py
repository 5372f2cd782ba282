"""Rows and phase changes of two runs find their counterparts."""

from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipgrasp.core.trace.types import ContactPhase, PhaseChange
from slipgrasp.recordings.compare.alignment import MOST_ALIGNED, match_phase_changes, match_rows

STICK, FORWARD = ContactPhase.STICK, ContactPhase.SLIP_FORWARD


def change(time, to_phase, contact=0):
    from_phase = STICK if to_phase is not STICK else FORWARD
    return PhaseChange(time=time, contact=contact, from_phase=from_phase, to_phase=to_phase)


def slip(start, end, contact=0):
    return [change(start, FORWARD, contact), change(end, STICK, contact)]


def matched(first, second):
    rows = match_rows(np.array(first, dtype=float), np.array(second, dtype=float))
    return list(zip(rows.first.tolist(), rows.second.tolist(), strict=True)), rows.num_instants


def test_different_rates_meet_at_common_multiples():
    tenths, quarters = np.arange(11) / 10, np.arange(5) / 4

    assert matched(tenths, quarters) == ([(0, 0), (5, 2), (10, 4)], 3)


def test_before_an_event_goes_with_before_and_after_with_after():
    assert matched([0, 1, 1, 2], [0, 1, 1, 2]) == ([(0, 0), (1, 1), (2, 2), (3, 3)], 3)


def test_an_event_against_a_single_row_is_compared_on_both_sides():
    assert matched([0, 1, 1, 2], [0, 1, 2]) == ([(0, 0), (1, 1), (2, 1), (3, 2)], 3)


def test_times_are_the_same_within_a_nanosecond_only():
    assert matched([0, 1 + 0.9e-9, 2], [0, 1, 2 + 1.1e-9]) == ([(0, 0), (1, 1)], 2)


def test_runs_without_a_common_instant_have_no_rows():
    assert matched([0, 1], [0.5]) == ([], 0)


def test_a_slip_that_only_one_run_has_does_not_shift_those_that_follow():
    first = [*slip(1.0, 2.0), *slip(5.0, 6.0), *slip(8.0, 9.0)]
    second = [*slip(5.1, 6.1), *slip(8.1, 9.1)]

    pairs = match_phase_changes(first, second, 1)

    assert [(a and a.time, b and b.time) for a, b in pairs] == [
        (1.0, None), (2.0, None), (5.0, 5.1), (6.0, 6.1), (8.0, 8.1), (9.0, 9.1)
    ]  # fmt: skip


def test_contacts_are_paired_each_for_itself():
    first = [*slip(1.0, 2.0, contact=0), *slip(3.0, 4.0, contact=1)]
    second = slip(1.0, 2.0, contact=1)

    pairs = match_phase_changes(first, second, 2)

    assert [(a and a.time, b and b.time) for a, b in pairs] == [
        (1.0, None), (3.0, 1.0), (2.0, None), (4.0, 2.0)
    ]  # fmt: skip


def longest_common(first, second):
    """Length of the longest common subsequence, by trying all."""
    for count in range(min(len(first), len(second)), 0, -1):
        if set(combinations(first, count)) & set(combinations(second, count)):
            return count
    return 0


CHANGES = st.lists(
    st.tuples(st.floats(0.0, 10.0), st.sampled_from([STICK, FORWARD])), max_size=6
).map(lambda drawn: [change(time, phase) for time, phase in sorted(drawn)])


@settings(max_examples=200, deadline=None)
@given(CHANGES, CHANGES)
def test_as_many_phase_changes_as_possible_are_paired_in_order(first, second):
    pairs = match_phase_changes(first, second, 1)

    both = [(a, b) for a, b in pairs if a is not None and b is not None]
    kinds = [[c.to_phase for c in changes] for changes in (first, second)]
    assert len(both) == longest_common(*kinds)
    assert all(a.to_phase is b.to_phase for a, b in both)
    for side, changes in enumerate((first, second)):
        own = [pair[side] for pair in pairs if pair[side] is not None]
        assert sorted(map(id, own)) == sorted(map(id, changes))
        places = [[id(c) for c in changes].index(id(pair[side])) for pair in both]
        assert len(set(places)) == len(places)
    orders = [
        sorted(both, key=lambda pair: [id(c) for c in changes].index(id(pair[side])))
        for side, changes in enumerate((first, second))
    ]
    assert orders[0] == orders[1]


def test_only_changes_between_the_same_phases_are_paired():
    every = [
        PhaseChange(time=0.0, contact=0, from_phase=before, to_phase=after)
        for before, after in permutations(ContactPhase, 2)
    ]
    for mine, other in combinations(every, 2):
        assert match_phase_changes([mine], [other], 1) == [(mine, None), (None, other)]


@pytest.mark.parametrize("count", [MOST_ALIGNED - 1, 2 * MOST_ALIGNED + 1])
def test_many_phase_changes_are_all_paired(count):
    first = [change(k, (STICK, FORWARD)[k % 2]) for k in range(count)]
    second = [change(k + 0.25, (STICK, FORWARD)[k % 2]) for k in range(count)]

    pairs = match_phase_changes(first, second, 1)

    assert [(a.time, b.time) for a, b in pairs if a and b] == [(k, k + 0.25) for k in range(count)]
