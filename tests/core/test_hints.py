"""Hints: one followed as it stands makes the run better; what is left open stays words."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario.law_choice import LAW, with_law
from slipgrasp.core.scenario.loading import load_scenario, parameter_definitions, with_values
from slipgrasp.core.words.endings import hint_for
from slipgrasp.core.words.hints import Hint, any_of
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


def tried(preset: str, trial: Option) -> RunResult:
    scenario = run_of(preset).scenario
    if LAW in trial.values:
        return simulate(with_law(scenario, str(trial.values[LAW])))
    return simulate(with_values(scenario, dict(trial.values)))


@pytest.mark.parametrize(
    ("preset", "trials"),
    [("paper-case-1", 3), ("paper-case-2", 3), ("composite-case-2", 2), ("wet-patch", 2)],
)
def test_every_trial_of_a_run_makes_it_better(preset: str, trials: int) -> None:
    """Nearer to where it was wanted where that is what the hint is for, and less slip."""
    before = run_of(preset)
    hint = describe_run(before).hint
    found = hint.trials
    assert len(found) == trials
    for trial in found:
        after = tried(preset, trial)
        assert after.metrics.held
        assert max(after.metrics.slip_path) < max(before.metrics.slip_path)
        if "nearer to where" in hint.purpose:
            errors = [run.metrics.final_tracking_error[:2] for run in (before, after)]
            offsets = [x * x + y * y for x, y in errors]
            assert offsets[1] < 0.8 * offsets[0]


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
    assert "no setting of this law is left" in str(any_of([]))


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
