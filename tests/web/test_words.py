"""Runs and parameters in words, and the outcome card."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import Outcome, Reason, RunWarning
from slipgrasp.core.words.parameter_words import key_words, unit_words
from slipgrasp.web.model.draft import error_words
from slipgrasp.web.model.parameter_names import in_page_words
from slipgrasp.web.model.view import RunStage, RunStatus, Shown
from slipgrasp.web.panels.outcome_panel import outcome_html

DROPPED = Reason(
    code="contact_separation",
    message="the left contact came apart at 0.12 s",
    contact=0,
    time=0.12,
    value=-0.1,
    limit=0.0,
    hint="raise controller.grip_safety",
)


def test_the_colour_of_a_headline_tells_held_moved_and_lost_apart(
    case_1: RunResult, case_2: RunResult
) -> None:
    still = simulate(with_values(case_1.scenario, {"controller.position_gain": 1e4}))
    lost = replace(case_1, outcome=Outcome.SEPARATED, reason=DROPPED)
    found = [describe_run(each) for each in (still, case_2, lost)]
    assert [each.tone for each in found] == ["good", "warning", "bad"]
    assert found[0].headline == "Held"
    assert re.match(r"Held after 47\.\d mm of slip", found[1].headline)


def test_warnings_of_a_run_are_on_its_card(case_1: RunResult) -> None:
    warning = RunWarning(code="x", message="a <b> happened", count=2, first_time=0.05)
    card = outcome_html(
        RunStatus(RunStage.PREVIEW), Shown(1, replace(case_1, warnings=(warning,)), 0.02)
    )
    assert "a &lt;b&gt; happened (2 times, first at t = 50 ms)" in card


def test_an_error_of_a_timed_change_is_told_like_that_of_a_value() -> None:
    def told(message: str) -> str:
        return error_words(FieldError(field="", value=None, limit=None, message=message))

    assert told("changes.0.value: object.mass is -1.0: too small") == (
        "object.mass is -1.0: too small"
    )
    assert told("changes.12.time is 9 s, not before the end") == (
        "the time of the change is 9 s, not before the end"
    )
    assert told("object.mass is -1.0") == "object.mass is -1.0"


def test_fingers_on_one_face_are_numbered() -> None:
    scenario = load_scenario("paper-case-1")
    left, right = scenario.fingers
    assert scenario.finger_names == ("left", "right")
    assert replace(scenario, fingers=(left, right, right)).finger_names == (
        "left",
        "right 1",
        "right 2",
    )


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("object.mass", "object mass"),
        ("fingers.0.link_masses.1", "left link mass 2"),
        ("fingers.1.friction", "right friction"),
        ("controller.estimate_norm_bound", "controller estimate norm bound"),
        ("controller.lyapunov_weight", "controller Lyapunov weight Q"),
        ("controller.velocity_gain.3", "controller velocity gain Kᵥ 4"),
        ("controller.kind", "control law"),
    ],
)
def test_keys_in_words(key: str, words: str) -> None:
    assert key_words(key, ("left", "right")) == words


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("raise controller.grip_safety above 1", "raise grip safety above 1"),
        ("lower fingers.*.friction.", "lower friction of all fingers."),
        (
            "set estimates.4.initial nearer to 1 kg",
            "set initial estimate of object mass nearer to 1 kg",
        ),
        ("move (fingers.0.base)", "move (left base)"),
        ("choose another motion (trajectory)", "choose another motion (trajectory)"),
        ("raise controller.lyapunov_weight", "raise Lyapunov weight Q"),
        ("at 0.12 s, 3.5 kg", "at 0.12 s, 3.5 kg"),
    ],
)
def test_the_page_calls_parameters_in_sentences_as_on_their_controls(text: str, told: str) -> None:
    assert in_page_words(text, load_scenario("paper-case-1")) == told


def test_units_for_labels() -> None:
    assert (unit_words("kg m²"), unit_words("1"), unit_words("")) == (" [kg m²]", "", "")


def test_the_card_names_the_saved_run(case_1: RunResult) -> None:
    card = outcome_html(RunStatus(RunStage.SAVED, run_id="abc123abc123"), Shown(1, case_1, 0.02))
    assert "Saved as <b>abc123abc123</b>" in card
    assert "Held" in card
    assert "Computed in 20 ms" in card


def test_the_card_of_a_refused_scenario_keeps_the_last_run(case_1: RunResult) -> None:
    error = ScenarioError(
        [FieldError(field="object.mass", value=-1.0, limit=None, message="object.mass is -1")]
    )
    card = outcome_html(RunStatus.refused(error), Shown(1, case_1, 0.02))
    assert "Not simulated" in card
    assert "object.mass is -1" in card
    assert "last valid run" in card
    assert "Held" in card


def test_nothing_from_outside_becomes_markup() -> None:
    hostile = "<script>alert(1)</script>"
    card = outcome_html(RunStatus(RunStage.REFUSED, (hostile,)), None)
    assert hostile not in card
    assert "&lt;script&gt;" in card


def test_the_card_explains_the_first_compilation() -> None:
    card = outcome_html(RunStatus(RunStage.COMPILING, ("40% done, about 50 s to go",)), None)
    assert "Compiling the simulation for this machine: 40% done, about 50 s to go." in card
    assert "This happens once" in card


def test_the_card_tells_what_matters_most_and_unfolds_the_rest(case_2: RunResult) -> None:
    status = RunStatus(RunStage.REPLAY)  # nothing is tried
    card = outcome_html(status, Shown(1, case_2, 0.02))
    plain, unfolded = card.split("<details data-sg-fold='outcome'>")
    assert "title='Green: held near its target" in plain
    assert "Both fingertips slipped" in plain
    assert "friction as 1.2; it is 0.25" in plain
    assert "First to slip: left and right, t = 0 ms" in plain
    assert "Set initial estimate of left friction below 0.25" in plain
    soon = outcome_html(RunStatus(RunStage.PREVIEW), Shown(1, case_2, 0.02))
    assert "simulating what could help" in soon
    # The two are alike but for rounding; told is the one with the least to spare.
    normal, across = case_2.trace.normal_force[-1], np.abs(case_2.trace.tangential_force[-1])
    side = ("left", "right")[int(np.argmin(normal - across / 0.25))]
    assert f"At the end the {side} fingertip presses with" in unfolded
    assert "smallest margin" in unfolded


def test_the_card_names_the_fingertip_that_slips_first() -> None:
    scenario = load_scenario("wet-patch")
    result = simulate(scenario)
    first = min(change.time for change in result.phase_changes if change.to_phase)
    (contact,) = {c.contact for c in result.phase_changes if c.time == first and c.to_phase}
    card = outcome_html(RunStatus(RunStage.PREVIEW), Shown(1, result, 0.02))
    assert f"First to slip: {scenario.finger_names[contact]}, t = " in card
    assert f"t = {1e3 * first:.4g} ms" in card
    still = simulate(with_values(scenario, {"patches": [], "controller.grip_safety": 2.0}))
    assert not any(still.metrics.slip_path)
    assert "First to slip" not in outcome_html(RunStatus(RunStage.PREVIEW), Shown(1, still, 0.02))
