"""Runs and parameters in words, and the outcome card."""

from __future__ import annotations

from dataclasses import replace

import pytest

from core.exceptions import FieldError, ScenarioError
from core.loading import load_scenario
from core.result import RunResult
from core.types import Outcome, Reason
from web.panels.outcome_panel import outcome_html
from web.view import RunStage, RunStatus, Shown
from web.words import describe_outcome, key_words, unit_words

DROPPED = Reason(
    code="contact_separation",
    message="the left contact came apart at 0.12 s",
    contact=0,
    time=0.12,
    value=-0.1,
    limit=0.0,
    hint="raise controller.grip_safety",
)


def test_a_held_run_says_how_far_each_fingertip_slipped_and_when_it_stopped(
    case_1: RunResult,
) -> None:
    verdict = describe_outcome(case_1)
    assert (verdict.tone, verdict.headline) == ("good", "Held")
    assert verdict.sentences == (
        "Both fingertips slipped, 2.59 mm left and 2.14 mm right, and stopped at t = 87 ms.",
    )


def test_a_dropped_object_comes_with_reason_and_way_out(case_1: RunResult) -> None:
    verdict = describe_outcome(replace(case_1, outcome=Outcome.SEPARATED, reason=DROPPED))
    assert verdict.tone == "bad"
    assert verdict.headline.startswith("Dropped")
    assert verdict.sentences[:2] == (
        "The left contact came apart at 0.12 s.",
        "Raise controller.grip_safety.",
    )


def test_a_run_that_slips_at_its_end_is_not_called_held(case_1: RunResult) -> None:
    metrics = replace(case_1.metrics, held=False, slipping_at_end=True)
    verdict = describe_outcome(replace(case_1, metrics=metrics))
    assert verdict.tone == "warning"
    assert "stopped" not in verdict.sentences[-1]


def test_a_run_without_slip_says_so(case_1: RunResult) -> None:
    metrics = replace(case_1.metrics, slip_path=(0.0, 0.0), last_slip_time=None)
    assert describe_outcome(replace(case_1, metrics=metrics)).sentences == (
        "No fingertip slipped.",
    )


def test_one_slipping_fingertip_is_named(case_1: RunResult) -> None:
    metrics = replace(case_1.metrics, slip_path=(0.0, 0.002))
    sentence = describe_outcome(replace(case_1, metrics=metrics)).sentences[0]
    assert sentence.startswith("The right fingertip slipped, 2 mm right")


@pytest.mark.parametrize("outcome", list(Outcome))
def test_every_outcome_has_words(case_1: RunResult, outcome: Outcome) -> None:
    assert describe_outcome(replace(case_1, outcome=outcome)).headline


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
    ],
)
def test_keys_in_words(key: str, words: str) -> None:
    assert key_words(key, ("left", "right")) == words


def test_units_for_labels() -> None:
    assert (unit_words("kg m^2"), unit_words("1"), unit_words("")) == (" [kg m²]", "", "")


def test_the_card_links_to_the_saved_run(case_1: RunResult) -> None:
    card = outcome_html(RunStatus(RunStage.SAVED, run_id="abc123abc123"), Shown(1, case_1, 0.02))
    assert "href='/api/v1/runs/abc123abc123/recording'" in card
    assert "Held" in card
    assert "Computed in 20 ms" in card


def test_the_card_of_a_refused_scenario_keeps_the_last_run(case_1: RunResult) -> None:
    error = ScenarioError(
        [FieldError(field="object.mass", value=-1.0, limit=None, message="object.mass is -1")]
    )
    card = outcome_html(RunStatus.refused(error), Shown(1, case_1, 0.02))
    assert "Not simulated" in card
    assert "object.mass is -1" in card
    assert "last run that worked" in card
    assert "Held" in card


def test_nothing_from_outside_becomes_markup() -> None:
    hostile = "<script>alert(1)</script>"
    card = outcome_html(RunStatus(RunStage.REFUSED, (hostile,)), None)
    assert hostile not in card
    assert "&lt;script&gt;" in card


def test_the_card_explains_the_first_compilation() -> None:
    card = outcome_html(RunStatus(RunStage.COMPILING), None)
    assert "compiled for this machine, once" in card
