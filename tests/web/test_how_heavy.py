"""How much heavier the object may get, asked at a button of the card."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.study.margin import find_margin
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.server.runs.service import RunService
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.heavier import AskHowHeavy, HowHeavyFound
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.panels.outcome_panel import outcome_html
from slipgrasp.web.reducers.heavier import HeavierReducer
from slipgrasp.web.workers.heavier_worker import find_border
from tests.server.serving import patient_settings
from tests.waiting import wait_until
from tests.web.test_charts_panel import view_of

QUESTION = "How much heavier may it get?"


def run(draft: Draft) -> RunResult:
    return simulate(draft.scenario())


def test_the_border_is_that_of_the_margin_command() -> None:
    words = find_border(Draft.from_preset("paper-case-1"), run)
    numbers = re.findall(r"[\d.]*\d", words)
    held_at, times, offset, lost_at = map(float, numbers[:4])
    assert words.startswith(
        f"Held up to {held_at} kg, {times} times its mass, there {offset:g} mm from its "
        f"target. With {lost_at} kg the result is “"
    )
    assert times == held_at
    assert held_at < lost_at < 1.01 * held_at
    there = simulate(with_values(load_scenario("paper-case-1"), {"object.mass": held_at}))
    x, y, _ = there.metrics.final_tracking_error
    assert offset == pytest.approx(1e3 * math.hypot(x, y), abs=1.0)
    margin = find_margin(load_scenario("paper-case-1"), "object.mass", 1.0, 10.0)
    assert margin.held_at == pytest.approx(held_at, rel=0.01)


def test_what_cannot_be_run_and_what_is_never_lost_are_said() -> None:
    draft = Draft.from_preset("paper-case-2")
    held = run(draft)
    assert find_border(draft, lambda _: None) == (
        "Held up to 1 kg at least; heavier objects took too long."
    )
    assert find_border(draft, lambda _: held) == (
        "Held up to 97 kg, there 25 mm from its target; heavier was not tried."
    )


def test_the_card_asks_and_shows_the_answer_to_what_is_on_the_screen(
    store: RecordingStore, tmp_path: Path, case_2: RunResult
) -> None:
    sent: list[Intent] = []
    service = RunService(store, patient_settings(tmp_path / "data"))
    reducer, view = HeavierReducer(service, sent.append), view_of(case_2)
    assert QUESTION in outcome_html(view.status, view.shown)
    asked = reducer.reduce(AskHowHeavy(), view)
    assert asked.how_heavy.draft is view.draft
    wait_until(lambda: sent, "there is no answer")
    (answer,) = sent
    assert isinstance(answer, HowHeavyFound)
    assert reducer.reduce(replace(answer, number=9), asked) is asked
    told = reducer.reduce(answer, asked).how_heavy.words
    assert told == find_border(view.draft, run)
    card = outcome_html(view.status, view.shown, told)
    assert told in card and QUESTION not in card
    for worker in reducer.workers:
        worker.close()


@pytest.mark.parametrize("preset", ["poured-mass", "paper-case-2"])
def test_of_what_is_poured_or_lost_it_is_not_asked(preset: str) -> None:
    """Another mass from the start on would take the pour away."""
    friction = {"fingers.0.friction": 0.1} if preset == "paper-case-2" else {}
    result = simulate(with_values(load_scenario(preset), friction))
    view = view_of(result)
    assert result.metrics.held == (preset == "poured-mass")
    assert QUESTION not in outcome_html(view.status, view.shown)
