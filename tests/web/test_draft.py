"""What is asked for: values for the whole run, and values from some time on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Change
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.web.model.draft import Draft, TimedEdit, Value, change_time

MASS, FRICTION, WIDTH = "object.mass", "fingers.0.friction", "object.half_width"


@pytest.fixture
def draft() -> Draft:
    return Draft.from_preset("paper-case-2")


def test_a_value_from_some_time_on_is_a_timed_change_of_the_scenario(draft: Draft) -> None:
    edited = draft.edited_from(0.05, MASS, 1.4)
    assert edited.scenario().changes == (Change(time=0.05, parameter=MASS, value=1.4),)
    assert edited.scenario().object.mass == 1.0
    assert [edited.value_at(t, MASS) for t in (0.0, 0.049999, 0.05, 1.0)] == [1.0, 1.0, 1.4, 1.4]


def test_a_value_from_the_start_on_is_simply_another_scenario(draft: Draft) -> None:
    later = draft.edited_from(1.0, MASS, 1.4)
    assert draft.edited_from(0.0, MASS, 2.0).scenario() == with_values(draft.base, {MASS: 2.0})
    assert later.edited_from(0.0, MASS, 2.0).changes == later.changes


def test_a_second_value_at_the_same_time_replaces_the_first(draft: Draft) -> None:
    edited = draft.edited_from(1.0, MASS, 1.4).edited_from(1.0, MASS, 1.5)
    assert edited.changes == (TimedEdit(1.0, MASS, 1.5),)


def test_changes_stand_in_order_of_time(draft: Draft) -> None:
    edited = draft.edited_from(2.0, MASS, 1.4).edited_from(1.0, FRICTION, 0.3)
    edited = edited.edited_from(1.5, MASS, 1.2)
    assert [(c.time, c.value) for c in edited.changes] == [(1.0, 0.3), (1.5, 1.2), (2.0, 1.4)]
    assert edited.num_changes_until(1.5) == 2
    assert edited.without_change(1.5, MASS).value_at(1.7, MASS) == 1.0
    assert edited.without_changes() == draft


def test_a_value_that_holds_anyway_needs_no_change(draft: Draft) -> None:
    assert draft.edited_from(1.0, MASS, 1.4).edited_from(1.0, MASS, 1.0) == draft


def test_a_value_on_the_whole_run_takes_away_the_changes_of_its_parameter(draft: Draft) -> None:
    edited = draft.edited_from(1.0, MASS, 1.4).edited_from(1.0, FRICTION, 0.3)
    edited = edited.edited(MASS, 2.0)
    assert edited.changes == (TimedEdit(1.0, FRICTION, 0.3),)
    assert edited.value_at(3.0, MASS) == 2.0


def test_what_cannot_change_during_a_run_acts_on_all_of_it(draft: Draft) -> None:
    edited = draft.edited_from(1.0, WIDTH, 0.12)
    assert edited.changes == ()
    assert edited.scenario().object.half_width == 0.12


def test_a_scenario_keeps_its_own_changes_until_they_are_taken_away(draft: Draft) -> None:
    changes = (Change(time=2.0, parameter=MASS, value=1.2),)
    own = Draft.starting_from("file", replace(draft.base, changes=changes))
    assert own.scenario() == own.base
    assert not own.is_touched
    assert own.without_changes().is_touched
    assert own.without_changes().scenario() == draft.base
    assert own.without_changes().reset() == own


@pytest.mark.parametrize(
    ("time", "key", "value", "wrong"),
    [
        (1.0, MASS, -1.0, MASS),
        (0.0, MASS, -1.0, MASS),
        (9.0, MASS, 1.4, MASS),
        (1.0, "controller.control_period", 5e-5, "controller.control_period"),
        (1.0, "controller.position_gain", [1.0, 2.0], "controller.position_gain"),
        (1.0, MASS, float("nan"), MASS),
        (1.0, MASS, "heavy", MASS),
    ],
)
def test_an_error_is_told_of_the_parameter_that_was_set(
    draft: Draft, time: float, key: str, value: Value, wrong: str
) -> None:
    edited = draft.edited_from(time, key, value)
    with pytest.raises(ScenarioError) as caught:
        edited.scenario()
    assert {edited.key_of(error) for error in caught.value.errors} == {wrong}


@pytest.mark.parametrize("time", [0.0123, 0.0777, 1.0, 2.3333])
@pytest.mark.parametrize("preset", ["paper-case-1", "paper-case-2"])
def test_a_run_is_the_same_before_a_change_and_another_after_it(
    preset: str, time: float, case_1: RunResult, case_2: RunResult
) -> None:
    before = {"paper-case-1": case_1, "paper-case-2": case_2}[preset]
    edited = Draft.from_preset(preset).edited_from(change_time(time), MASS, 1.4)
    after = simulate(edited.scenario())
    rows, others = _rows_of_both(before, after, time)
    # A step of the integration ends at the change; before that step nothing is different.
    last_step = _start_of_last_step(rows, others)
    assert rows[:last_step].tobytes() == others[:last_step].tobytes()
    assert np.array_equal(rows[:, 0], others[:, 0])
    assert np.abs(rows - others).max(initial=0.0) < 1e-7
    assert time - np.append(rows[:, 0], time)[last_step] < before.scenario.simulation.max_step
    assert not np.array_equal(before.trace.object_pose[-1], after.trace.object_pose[-1])


def _rows_of_both(before: RunResult, after: RunResult, until: float) -> list[np.ndarray]:
    """Rows at the instants that both have: a slip cut in two has rows of its own in each part."""
    times = before.trace.times, after.trace.times
    common = np.intersect1d(*times)
    return [
        result.trace.to_rows()[np.isin(own, common) & (own < until)]
        for result, own in zip((before, after), times, strict=True)
    ]


def _start_of_last_step(rows: np.ndarray, others: np.ndarray) -> int:
    differs = (rows != others).any(axis=1)
    return int(np.argmax(differs)) if differs.any() else len(rows)


def test_sampled_control_makes_runs_equal_to_the_last_bit_before_a_change_at_a_tick(
    draft: Draft,
) -> None:
    sampled = draft.edited("controller.control_period", 0.001)
    before, after = (
        simulate(sampled.scenario()),
        simulate(sampled.edited_from(0.077, MASS, 1.4).scenario()),
    )
    rows, others = _rows_of_both(before, after, 0.077)
    assert len(rows) > 15
    assert rows.tobytes() == others.tobytes()
