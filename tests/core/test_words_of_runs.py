"""What is said of a run is so: of every law, in every way in which its runs can go.

Each run is simulated here, and every sentence, every option of the hint and the headline are held
against its trace and its scenario by `tests.core.reading_words`, which shares no code with them.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import pytest

from slipgrasp.cli.summary import summarize
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.verdict import describe_run, headline_of, title_of
from slipgrasp.core.scenario import CONTROL_LAWS
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import ContactPhase, Outcome
from slipgrasp.web.model.view import RunStage, RunStatus, Shown
from slipgrasp.web.panels.outcome_panel import outcome_html
from tests.core.drawn_scenarios import KINDS, draw_scenario
from tests.core.reading_words import check_words

Settings = tuple[str, dict[str, Any]]

LEFT, RIGHT = "fingers.0.friction", "fingers.1.friction"
ROUGH = {LEFT: 2.5, RIGHT: 2.5}
UNEQUAL = {LEFT: 2.5, RIGHT: 0.1}
BRIEF, SHORT = {"simulation.duration": 0.05}, {"simulation.duration": 0.3}
JERK = {"trajectory.acceleration": [0.0, 2.0, 0.0]}
STIFF, STIFFER = {"controller.position_gain": 1e3}, {"controller.position_gain": 1e6}
SAMPLED = {"controller.control_period": 0.001}
LOOSE = {"controller.grasp_force": "none"}
NARROW = {"object.face_half_length": 0.02}
# The presets of the composite law are set for what it can do; here they fail in every way.
LAX = {
    "controller.velocity_gain": 10.0,
    "controller.distribution": "exact",
    "controller.grip_safety": 1.05,
    "controller.probing": 0.0,
}
A, B, C, D = "composite-case-2", "paper-case-2", "unequal-fingers", "paper-case-1"

# Law, way: what to simulate, for 0.7 s where nothing else is said.
TABLE: dict[tuple[str, str], Settings] = {
    ("theorem-3", "held"): (A, STIFF),
    ("theorem-3", "held far off"): (A, {}),
    ("theorem-3", "held without slip"): (C, ROUGH),
    ("theorem-3", "slipping"): (A, BRIEF),
    ("theorem-3", "unsettled"): (A, SHORT),
    ("theorem-3", "contact_separation"): (C, {}),
    ("theorem-3", "contact_left_face"): (A, NARROW),
    ("theorem-3", "singular_jacobian"): (C, {**JERK, **ROUGH}),
    ("theorem-3", "chatter"): (A, LOOSE),
    ("theorem-3", "model_estimate_singular"): (B, {LEFT: 0.25, RIGHT: 0.3}),
    ("theorem-4", "held"): (A, STIFF),
    ("theorem-4", "contact_separation"): (C, {}),
    ("theorem-4", "chatter"): (A, LOOSE),
    ("theorem-4", "model_estimate_singular"): (B, {LEFT: 0.25, RIGHT: 0.3}),
    ("theorem-4", "step_underflow"): (D, {LEFT: 0.8, RIGHT: 0.1, "object.mass": 3.0, **LOOSE}),
    ("certainty-equivalence", "held"): (
        "wet-patch",
        {**SAMPLED, "simulation.duration": 5.0},
    ),
    ("certainty-equivalence", "too short"): (C, {**BRIEF, **ROUGH}),
    ("certainty-equivalence", "held without slip far off"): (C, ROUGH),
    ("certainty-equivalence", "slipping"): (A, BRIEF),
    ("certainty-equivalence", "unsettled"): (A, {**JERK, **ROUGH}),
    ("certainty-equivalence", "contact_separation"): (C, STIFFER),
    ("certainty-equivalence", "contact_left_face"): (A, {}),
    ("certainty-equivalence", "singular_jacobian"): (C, {**JERK, **ROUGH}),
    ("certainty-equivalence", "chatter"): (
        "three-fingers",
        {
            **LOOSE,
            **STIFFER,
            **{LEFT: 0.8, RIGHT: 0.1, "object.mass": 0.5, "controller.velocity_gain": 1e4},
        },
    ),
    ("pd-gravity", "held"): (C, STIFF),
    ("pd-gravity", "held far off"): (A, UNEQUAL),
    ("pd-gravity", "too short"): (A, BRIEF),
    ("pd-gravity", "held without slip far off"): (A, {}),
    ("pd-gravity", "slipping"): (C, BRIEF),
    ("pd-gravity", "unsettled"): (C, {}),
    ("pd-gravity", "contact_separation"): (C, STIFFER),
    ("pd-gravity", "contact_left_face"): (A, {"controller.grip_force": 15.0}),
    ("pd-gravity", "singular_jacobian"): (
        C,
        {
            **JERK,
            **STIFF,
            **{LEFT: 0.25, RIGHT: 2.5, "object.mass": 0.5, "controller.grip_force": 80.0},
        },
    ),
    ("grip-reflex", "held"): (C, STIFF),
    ("grip-reflex", "held far off"): (A, {"controller.grip_force": 2.0}),
    ("grip-reflex", "too short"): (A, BRIEF),
    ("grip-reflex", "held without slip far off"): (A, {}),
    ("grip-reflex", "slipping"): (C, BRIEF),
    ("grip-reflex", "unsettled"): (C, {}),
    ("grip-reflex", "contact_separation"): (A, STIFFER),
    ("grip-reflex", "contact_left_face"): (C, {"controller.grip_force": 2.0, **NARROW}),
    ("grip-reflex", "singular_jacobian"): (C, {**STIFF, **JERK}),
    ("composite", "held"): (A, {}),
    ("composite", "held far off"): (C, {"object.mass": 3.0, **UNEQUAL}),
    ("composite", "held without slip"): (C, ROUGH),
    ("composite", "slipping"): (B, {}),
    ("composite", "unsettled"): (A, BRIEF),
    ("composite", "contact_separation"): (A, STIFFER),
    ("composite", "contact_left_face"): (C, {**STIFFER, LEFT: 1.5, RIGHT: 2.5}),
    **{(law, "max_steps"): (A, {"simulation.max_steps": 3}) for law in CONTROL_LAWS},
}


@cache
def run_of(law: str, way: str) -> RunResult:
    preset, values = TABLE[law, way]
    period = SAMPLED if CONTROL_LAWS[law].sampled else {"controller.control_period": 0.0}
    duration = {"simulation.duration": 0.7}
    base = load_scenario(preset)
    lax = LAX if base.controller.kind == "composite" else {}
    settings = {"controller.kind": law, **lax, **period, **duration, **values}
    return simulate(with_values(base, settings))


def way_of(result: RunResult) -> str:
    """In which way a run went, from its trace alone."""
    if result.reason is not None:
        return result.reason.code
    recent = result.trace.times > result.end_time - 0.5
    slips = result.trace.phase != ContactPhase.STICK
    if slips[recent].any():
        return "slipping" if slips[-1].any() else "unsettled"
    if result.end_time < 0.5:
        return "too short"
    words = ["held", *["without slip"] * (not slips.any())]
    return " ".join([*words, *["far off"] * ("from its target" in headline_of(result))])


@pytest.mark.parametrize(("law", "way"), TABLE)
def test_what_is_said_of_a_run_is_so(law: str, way: str) -> None:
    result = run_of(law, way)
    assert way_of(result) == way
    check_words(result, describe_run(result))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_said_of_a_random_run_is_so(kind: Any, seed: int) -> None:
    result = simulate(draw_scenario(kind, f"words {seed}"))
    check_words(result, describe_run(result))


def test_bounds_are_asked_for_only_where_there_are_none() -> None:
    """First of the inertia, which ran through zero; then, where it has them, of another."""
    bounds = {"estimates.3.minimum": -1.0, "estimates.3.maximum": 1.0}
    values = {LEFT: 0.25, RIGHT: 0.3, "simulation.duration": 0.7}
    loose = simulate(with_values(load_scenario(B), values))
    bound = simulate(with_values(load_scenario(B), {**values, **bounds}))
    asked = [
        next(trial for trial in describe_run(run).hint.trials if "bounds" in trial.words)
        for run in (loose, bound)
    ]
    assert "(estimates.3.minimum and estimates.3.maximum first)" in asked[0].words
    assert {"estimates.3.minimum", "estimates.3.maximum"} <= asked[0].values.keys()
    assert "estimates.3" not in asked[1].words and "estimates.3.minimum" not in asked[1].values
    check_words(bound, describe_run(bound))


@pytest.mark.parametrize(
    ("pushes", "expected"),
    [
        (
            [{"time": 0.003181, "force": [2.8, 1.6]}],
            "As the push that began at t = 3 ms ended, the right fingertip began to slip.",
        ),
        (
            [{"time": 0.0, "force": [0.0, -2.9]}],
            "A push acted from the start, when both fingertips began to slip.",
        ),
    ],
)
def test_a_slip_at_the_end_or_start_of_a_push_is_not_said_to_be_during_it(
    pushes: list[dict[str, Any]], expected: str
) -> None:
    result = simulate(with_values(load_scenario("paper-case-1"), {"pulses": pushes}))
    verdict = describe_run(result)
    assert expected in verdict.sentences
    check_words(result, verdict)


def test_a_slip_between_two_pushes_belongs_to_the_later_one() -> None:
    pushes = [{"time": 0.25, "force": [0.5, 0.0]}, {"time": 0.3, "force": [0.0, -13.0]}]
    result = simulate(with_values(load_scenario("paper-case-1"), {"pulses": pushes}))
    assert any(change.time == pushes[1]["time"] for change in result.phase_changes)
    verdict = describe_run(result)
    assert any("During the push at t = 300 ms" in sentence for sentence in verdict.sentences)
    check_words(result, verdict)


def test_a_slip_after_a_change_is_described_with_it() -> None:
    changes = [{"time": 2.165, "parameter": "object.mass", "value": 4.0}]
    result = simulate(with_values(load_scenario("paper-case-1"), {"changes": changes}))
    verdict = describe_run(result)
    told = "Within 50 ms after object.mass changed at t = 2.165 s, both fingertips began to slip."
    assert told in verdict.sentences
    assert "and last stopped at" in verdict.sentences[0]
    check_words(result, verdict)


def test_a_belief_at_the_start_is_no_cure_for_the_slip_of_a_push() -> None:
    push = {"time": 0.5, "force": [0.0, -15.0]}
    values = {"pulses": [push], "simulation.duration": 2.0}
    result = simulate(with_values(load_scenario(A), values))
    assert result.metrics.slip_path[0] > 0.01
    verdict = describe_run(result)
    check_words(result, verdict)
    assert "estimates.0.initial below" not in verdict.suggestion
    unpushed = simulate(load_scenario("composite-case-2-noisy"))
    assert "estimates.0.initial below" in describe_run(unpushed).suggestion


@pytest.mark.parametrize("law", CONTROL_LAWS)
def test_what_is_said_of_a_run_that_somebody_or_something_ended_is_so(law: str) -> None:
    scenario = with_values(load_scenario("poured-mass"), {"controller.kind": law})
    stopped = simulate(scenario, should_stop=lambda: True)
    assert stopped.outcome is Outcome.STOPPED
    check_words(stopped, describe_run(stopped))
    late = simulate(scenario, wall_limit=0.0)
    assert late.outcome is Outcome.LIMIT
    check_words(late, describe_run(late))


@pytest.mark.parametrize("way", ["held", "held far off", "unsettled", "contact_separation"])
def test_the_command_line_and_the_page_say_the_same_without_the_title_of_a_preset(way: str) -> None:
    result = run_of("theorem-3", way)
    verdict, told = describe_run(result), summarize(result, None)
    card = outcome_html(RunStatus(RunStage.PREVIEW), Shown(1, result, 0.02))
    assert f"{verdict.headline}. {verdict.sentences[0]}" in told
    assert f"What to try: {verdict.suggestion}" in told
    assert verdict.headline in card
    for key in ("controller.", "estimates.", "simulation.", "fingers.", "actuation."):
        assert key not in card, "the page calls parameters as on their controls"
    assert result.scenario.title and title_of(result) == ""
    assert result.scenario.title not in told


def test_a_margin_within_the_rounding_is_told_as_none() -> None:
    result = simulate(load_scenario("composite-case-2"))
    metrics = replace(result.metrics, minimum_friction_margin=(-8.9e-16, 0.2446))
    told = summarize(replace(result, metrics=metrics), None)
    assert "in stick at least 0 N inside the cone" in told
    assert "in stick at least 0.245 N inside the cone" in told


def test_a_title_stands_over_the_run_that_it_announces_and_over_those_of_one_s_own() -> None:
    preset = load_scenario("composite-case-2")
    result = simulate(preset)
    assert title_of(result) == preset.title
    assert title_of(replace(result, outcome=Outcome.STOPPED)) == ""
    own = replace(result.scenario, title="what I try today")
    assert title_of(replace(result, scenario=own)) == "what I try today"


@pytest.mark.parametrize(
    ("preset", "values"),
    [
        # As their hints say: nearer beliefs, more stiffness, more grip, another law.
        ("paper-case-1", {"estimates.4.initial": 0.9}),
        ("paper-case-1", {"controller.position_gain": 300.0}),
        ("paper-case-2", {"estimates.0.initial": 0.3, "estimates.1.initial": 0.3}),
        ("paper-case-2", {"controller.position_gain": 300.0}),
    ],
)
def test_what_is_suggested_brings_the_object_nearer_to_where_it_was_wanted(
    preset: str, values: dict[str, float]
) -> None:
    before = simulate(load_scenario(preset))
    trials = describe_run(before).hint.trials
    assert any(values.keys() <= trial.values.keys() for trial in trials)
    after = simulate(with_values(before.scenario, values))
    assert abs(after.metrics.final_tracking_error[1]) < 0.8 * abs(
        before.metrics.final_tracking_error[1]
    )


def test_a_hint_offers_nothing_where_nothing_is_left_to_set() -> None:
    """Everything known, the firmest grip, and still too heavy for the joints."""
    values = {
        "controller.grip_safety": 10.0,
        "controller.slip_stop": 100.0,
        **{f"estimates.{k}.initial": v for k, v in enumerate((0.25, 0.25, 1.0, 0.01042))},
        "simulation.duration": 0.5,
        "pulses": [{"time": 0.05, "duration": 0.4, "force": [0.0, -4000.0]}],
    }
    result = simulate(with_values(load_scenario("composite-case-2"), values))
    assert result.outcome.ended_by_physics
    check_words(result, describe_run(result))
    hint = result.reason.hint
    assert "raise controller" not in hint and "composite" not in hint


def test_a_gripper_says_with_which_force_it_had_not_slipped() -> None:
    def words(force: float) -> str:
        grip = {"controller.grip_force": force, "simulation.duration": 0.3}
        scenario = with_values(load_scenario("parallel-gripper"), grip)
        return " ".join(describe_run(simulate(scenario)).sentences)

    assert words(40.0).startswith("No fingertip slipped; ")
    assert "; earlier it needed up to 29.2 N." in words(40.0)
    assert words(29.2).startswith("No fingertip slipped; ")
    assert words(29.1).startswith("Both fingertips slipped by less than 1 nm")
