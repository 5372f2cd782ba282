"""Trials: a hint followed as it stands makes the run better."""

from __future__ import annotations

from functools import cache

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario.law_choice import LAW, with_law
from slipgrasp.core.scenario.loading import load_scenario, parameter_definitions, with_values
from slipgrasp.core.words.trials import Trial, purpose_of, trials_in


@cache
def run_of(preset: str) -> RunResult:
    return simulate(load_scenario(preset))


def suggestion_for(preset: str) -> str:
    return describe_run(run_of(preset)).suggestion


def tried(preset: str, trial: Trial) -> RunResult:
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
    before, hint = run_of(preset), suggestion_for(preset)
    found = trials_in(hint, before.scenario)
    assert len(found) == trials
    for trial in found:
        after = tried(preset, trial)
        assert after.metrics.held
        assert max(after.metrics.slip_path) < max(before.metrics.slip_path)
        if "nearer to where" in hint:
            errors = [run.metrics.final_tracking_error[:2] for run in (before, after)]
            offsets = [x * x + y * y for x, y in errors]
            assert offsets[1] < 0.8 * offsets[0]


def test_a_trial_stays_within_the_bounds_of_its_parameter() -> None:
    scenario = load_scenario("composite-case-2")
    definition = parameter_definitions(scenario)["controller.grip_safety"]
    assert definition.maximum is not None
    near = f"Raise controller.grip_safety above {definition.maximum - 0.1:g}."
    (trial,) = trials_in(near, scenario)
    assert trial.values == {"controller.grip_safety": definition.maximum}


@pytest.mark.parametrize(
    ("hint", "values"),
    [
        (
            "Lower fingers.*.friction, until a fingertip slips.",
            {"fingers.0.friction": 0.125, "fingers.1.friction": 0.125},
        ),
        ("Set controller.grasp_force to minimum.", {"controller.grasp_force": "minimum"}),
        ("Set controller.control_period to 0.001 s.", {"controller.control_period": 0.001}),
        ("Use the composite law.", {LAW: "composite"}),
        ("Raise simulation.max_steps above 1000.", {"simulation.max_steps": 2000}),
        ("Lower controller.position_gain below 100 1/s².", {"controller.position_gain": 50.0}),
    ],
)
def test_options_say_what_they_set(hint: str, values: dict[str, object]) -> None:
    scenario = load_scenario("paper-case-2")
    (trial,) = trials_in(hint, scenario)
    assert trial.values == values
    assert purpose_of(hint) in ("", "until a fingertip slips")


@pytest.mark.parametrize(
    "hint",
    [
        "Use a longer face (object.half_width).",
        "Change the pose or lower fingers.*.friction.",
        "No setting of this law is left to try: make the object lighter or its faces rougher.",
        "Raise no_such.parameter above 3 or use a longer face (object.half_width).",
    ],
)
def test_options_that_leave_open_what_to_set_stay_words(hint: str) -> None:
    scenario = load_scenario("paper-case-2")
    assert purpose_of(hint) is None
    assert [list(trial.values) for trial in trials_in(hint, scenario)] in (
        [],
        [["fingers.0.friction", "fingers.1.friction"]],
    )
