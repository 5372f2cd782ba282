"""Hints: one followed as it stands makes the run better; what is left open stays words."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from random import Random
from typing import Any

import pytest

from benchmarks.hints import does_what_it_says, draw, press_hints, tabulate
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.trying import Budget, follow, try_hint
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario import PlanarScenario
from slipgrasp.core.scenario.law_choice import LAW
from slipgrasp.core.scenario.loading import load_scenario, parameter_definitions, with_values
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.study.margin import find_margin
from slipgrasp.core.words.endings import hint_for
from slipgrasp.core.words.hints import Goal, Hint, any_of
from slipgrasp.core.words.options import (
    Option,
    believe_in_less,
    believe_the_truth,
    lower,
    lower_all_friction,
    only_words,
    raise_,
    sample_at_1_khz,
    set_to,
    use_law,
)


@cache
def run_of(preset: str) -> RunResult:
    return simulate(load_scenario(preset))


@pytest.mark.parametrize("preset", ["paper-case-1", "paper-case-2", "composite-case-2-noisy"])
def test_every_hint_that_was_tried_does_what_it_says(preset: str) -> None:
    """Nearer to its target where that is what the hint is for, else less slip."""
    before = run_of(preset)
    found = try_hint(before, describe_run(before).hint)
    assert len(found.helpful) >= 2
    for each in found.helpful:
        after = simulate(follow(before.scenario, each.option))
        assert does_what_it_says(each.effect, before, after, found.hint.goal)


SCENARIO = load_scenario("paper-case-2")


def test_a_trial_stays_within_the_bounds_of_its_parameter() -> None:
    most = parameter_definitions(SCENARIO)["controller.grip_safety"].maximum
    assert most is not None
    near = with_values(SCENARIO, {"controller.grip_safety": most - 0.1})
    (trial,) = raise_(near, "controller.grip_safety")
    assert trial.values == {"controller.grip_safety": most}
    full = with_values(SCENARIO, {"controller.grip_safety": most})
    assert not list(raise_(full, "controller.grip_safety"))


@pytest.mark.parametrize(
    ("options", "words", "label", "values"),
    [
        (
            lower_all_friction(SCENARIO),
            "lower fingers.*.friction",
            "fingers.*.friction: 0.125",
            {"fingers.0.friction": 0.125, "fingers.1.friction": 0.125},
        ),
        (
            [set_to("controller.grasp_force", "minimum")],
            "set controller.grasp_force to minimum",
            "controller.grasp_force: minimum",
            {"controller.grasp_force": "minimum"},
        ),
        (
            [sample_at_1_khz()],
            "set controller.control_period to 0.001 s",
            "controller.control_period: 0.001 s",
            {"controller.control_period": 0.001},
        ),
        ([use_law("composite")], "use the composite law", "composite law", {LAW: "composite"}),
        (
            raise_(SCENARIO, "simulation.duration"),
            "raise simulation.duration above 7 s",
            "simulation.duration: 7 → 14 s",
            {"simulation.duration": 14.0},
        ),
        (
            lower(SCENARIO, "controller.position_gain"),
            "lower controller.position_gain below 100 1/s²",
            "controller.position_gain: 100 → 50 1/s²",
            {"controller.position_gain": 50.0},
        ),
        (
            believe_the_truth(SCENARIO, {0: 0.4}),
            "set estimates.0.initial nearer to 0.4 (the truth)",
            "estimates.0.initial: 0.4 (the truth)",
            {"estimates.0.initial": 0.4},
        ),
        (
            believe_in_less(SCENARIO, {0: 0.25}),
            "set estimates.0.initial below 0.25",
            "estimates.0.initial: 0.2",
            {"estimates.0.initial": 0.2},
        ),
    ],
)
def test_options_set_what_they_say(
    options: Iterable[Option], words: str, label: str, values: dict[str, float | str]
) -> None:
    assert list(options) == [Option(words, values, label)]


def test_a_hint_joins_its_options_its_purpose_and_what_is_left_instead() -> None:
    raised, law = raise_(SCENARIO, "controller.position_gain"), [use_law("composite")]
    hint = any_of(raised, law, law, purpose="for less slip", instead="use a longer face")
    assert str(hint) == (
        "raise controller.position_gain above 100 1/s² or use the composite law, for less slip; "
        "or use a longer face"
    )
    assert len(hint.trials) == 2 and str(hint.rest) == "use a longer face"
    assert str(any_of([], instead="use a longer face")) == "use a longer face"
    assert str(any_of(law, purpose="for less slip").rest) == ""
    open_ = any_of(lower_all_friction(SCENARIO), only_words("change the pose"))
    assert len(open_.trials) == 1 and str(open_.rest) == "change the pose"
    assert "no other setting of this law can help" in str(any_of([]))


def test_what_lost_held_objects_is_named_with_that_warning_and_only_where_nothing_else_is() -> None:
    law, nearer = use_law("composite"), list(believe_the_truth(SCENARIO, {0: 0.4}))
    hint = any_of(nearer, purpose="for less slip", risky=[law])
    assert "composite" not in str(hint) and law in hint.trials
    alone = any_of([], purpose="for less slip", risky=[law])
    assert str(alone) == ("use the composite law, for less slip, which can also make it worse")


def test_only_the_three_most_successful_options_are_named() -> None:
    options = [set_to("controller.grip_force", float(k)) for k in range(5)]
    hint = any_of(options)
    assert str(hint).count("set controller.grip_force") == 3 and len(hint.trials) == 5


@pytest.mark.parametrize("law", ["theorem-4", "composite"])
def test_every_value_that_is_offered_lies_within_its_bounds(law: str) -> None:
    """Bounds with more digits than are told, on either side of what is wanted."""
    rng = Random(f"bounds {law}")
    base = with_values(SCENARIO, {"controller.kind": law, "controller.control_period": 0.001})
    for _ in range(200):
        low, high = rng.uniform(0.05, 0.6), rng.uniform(0.6, 2.0)
        bounds = {
            "estimates.0.minimum": low,
            "estimates.0.maximum": high,
            "estimates.0.initial": rng.uniform(low, high),
            "controller.grip_safety": rng.uniform(1.0, 10.0),
        }
        scenario, truth = with_values(base, bounds), rng.uniform(0.01, 3.0)
        for option in (
            *believe_the_truth(scenario, {0: truth}),
            *believe_in_less(scenario, {0: truth}),
            *raise_(scenario, "controller.grip_safety"),
            *lower(scenario, "controller.grip_safety"),
        ):
            followed = follow(scenario, option)  # raises ScenarioError beyond the bounds
            described = parameter_definitions(followed)
            assert {key: described[key].value for key in option.values} == option.values


def test_what_is_tried_is_counted_and_not_timed() -> None:
    """The same hints again; fewer runs or pieces only leave some out."""
    before = run_of("paper-case-1")
    hint = describe_run(before).hint
    once, again = (try_hint(before, hint) for _ in range(2))
    assert once == again and once.count > 1
    assert try_hint(before, hint, budget=Budget(runs=1)).count == 1
    stopped = try_hint(before, hint, should_stop=lambda: True)
    assert stopped.count == 0 and not stopped.helpful
    # No run of this one is over within a piece: nothing is known, and nothing is claimed.
    noisy = run_of("composite-case-2-noisy")
    slow = try_hint(noisy, describe_run(noisy).hint, budget=Budget(pieces_per_run=1))
    assert slow.count == 0 and str(slow) == str(slow.hint)


def test_where_nothing_tried_helps_that_is_said() -> None:
    weak = {"controller.kind": "composite", "actuation.torque_limit": 2.0}
    before = simulate(with_values(load_scenario("composite-case-2"), weak))
    assert before.outcome.ended_by_physics
    found = try_hint(before, describe_run(before).hint)
    assert found.count > 2 and not found.helpful
    assert str(found) == f"none of {found.count} changes tried holds the object"


UNFORESEEN = {
    "controller.kind": "theorem-3",
    "controller.velocity_gain": 10.0,
    "controller.latency": 0.015,
    "controller.prediction": False,
    "simulation.duration": 2.0,
}
LATE = {
    "controller.latency": 0.03,
    "controller.prediction": False,
    "controller.distribution": "exact",
}


def test_in_runs_too_short_to_tell_whether_anything_is_held_nothing_is_tried() -> None:
    brief = {"controller.kind": "pd-gravity", "controller.grip_force": 1.0}
    before = simulate(with_values(SCENARIO, {**brief, "simulation.duration": 0.3}))
    assert before.outcome.ended_by_physics
    found = try_hint(before, describe_run(before).hint)
    assert found.count == 0 and str(found) == before.reason.hint


@pytest.mark.parametrize(
    ("preset", "values", "cure"),
    [
        ("composite-case-2", LATE, "lower controller.latency"),
        ("three-fingers", UNFORESEEN, "controller.prediction"),
        ("composite-case-2", {"actuation.torque_limit": 11.0}, "actuation.torque_limit"),
        ("spatial-prism", {"controller.distribution": "exact"}, "controller.distribution to hold"),
        ("spatial-composite", {"controller.grip_safety": 1.0}, "controller.grip_safety to 1.05"),
    ],
)
def test_what_a_run_suffers_from_is_among_what_helps(
    preset: str, values: dict[str, Any], cure: str
) -> None:
    """A delay, weak joints, forces on the edges of their cones in two ways."""
    before = simulate(with_values(load_scenario(preset), values))
    found = try_hint(before, describe_run(before).hint)
    (each,) = [each for each in found.helpful if cure in each.option.words]
    after = simulate(follow(before.scenario, each.option))
    assert does_what_it_says(each.effect, before, after, found.hint.goal)


def test_a_delay_is_named_as_a_cause_of_a_loss() -> None:
    late = {
        "controller.kind": "certainty-equivalence",
        "controller.latency": 0.012,
        "sensing.true_phases": False,
        "sensing.slip_delay": 0.02,
    }
    lost = simulate(with_values(load_scenario("composite-case-2"), late))
    cause = describe_run(lost).sentences[0]
    assert lost.reason is not None and cause.lower().startswith(lost.reason.message.lower())
    assert "torques act 12 ms late (controller.latency)" in cause
    assert "slip is detected 20 ms late (sensing.slip_delay)" in cause


def test_an_object_that_is_held_as_it_should_be_leaves_the_question_of_its_margin() -> None:
    """The command that it names finds a border as it stands."""
    hint = describe_run(run_of("composite-case-2")).hint
    assert hint.goal is Goal.MARGIN and not hint.trials
    command = str(hint).partition("slipgrasp margin ")[2].replace("'", "").split()
    assert command[1:3] == ["--over", "fingers.*.friction"]
    start, stop = float(command[4]), float(command[6])
    margin = find_margin(run_of("composite-case-2").scenario, command[2], start, stop)
    assert stop < margin.held_at < start


@pytest.mark.slow
def test_hints_of_random_runs_do_what_they_say_when_pressed() -> None:
    """A sample of ``python -m benchmarks hints``."""
    cases = [press_hints(32, index) for index in range(24)]
    assert {type(draw(32, index)) for index in range(4)} == {PlanarScenario, SpatialScenario}
    presses = [press for case in cases for press in case.presses]
    assert len(presses) > 20 and all(press.is_true and press.holds for press in presses)
    rows = dict(tabulate(cases, 32).rows)
    assert rows["held objects that a hint lost"] == "0"


def test_a_hint_that_this_version_words_otherwise_stays_words() -> None:
    """Such as one in a recording of an older version: no button says what the card does not."""
    mapping = {"controller.kind": "pd-gravity", "controller.grip_force": 1.0}
    dropped = simulate(with_values(SCENARIO, mapping))
    reason, last = dropped.reason, dropped.trace[-1:]
    assert reason is not None
    known = hint_for(reason, SCENARIO, dropped.scenario, last)
    assert str(known) == reason.hint and known.trials
    older = replace(reason, hint="press harder")
    assert hint_for(older, SCENARIO, dropped.scenario, last) == Hint((Option("press harder"),))
    before_a_row = hint_for(reason, SCENARIO, dropped.scenario, last[:0])
    assert before_a_row == Hint((Option(reason.hint),))
