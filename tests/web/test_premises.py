"""Assumptions of the theorems on the card: computed on request, for the run on the screen."""

from __future__ import annotations

import queue
from dataclasses import replace
from html import escape

import pytest

from slipgrasp.core.run.premises import describe_premises
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.premises import FindPremises, PremisesFound
from slipgrasp.web.model.playback import WindowChoice
from slipgrasp.web.model.view import RunStage, RunStatus, Shown, ViewState
from slipgrasp.web.panels.outcome_panel import premises_html
from slipgrasp.web.reducers.premises import PremisesReducer
from tests.waiting import PATIENCE


def shown(name: str, ticket: int = 1) -> ViewState:
    run = simulate(with_values(load_scenario(name), {"simulation.duration": 0.15}))
    status = RunStatus(RunStage.PREVIEW)
    view = ViewState(draft=Draft.from_preset(name), status=status, choice=WindowChoice.SLIP)
    return replace(view, shown=Shown(ticket, run, 0.01))


@pytest.fixture
def answers() -> queue.SimpleQueue[Intent]:
    return queue.SimpleQueue()


def test_what_is_asked_for_is_found_and_told(answers):
    view, reducer = shown("paper-case-2"), PremisesReducer(answers.put)
    assert view.shown is not None and view.offers_premises

    asked = reducer.reduce(FindPremises(), view)
    assert "find-premises" in premises_html(view)
    assert not asked.offers_premises and "Looking" in premises_html(asked)
    answer = answers.get(timeout=PATIENCE)
    told = reducer.reduce(answer, asked)
    sentences = describe_premises(view.shown.result)
    assert [words.partition(":")[0] for words in sentences] == [
        "Theorem 1",
        "Theorem 2",
        "Theorems 3 and 4",
    ]
    assert all(escape(words) in premises_html(told) for words in sentences)


def test_an_answer_about_another_run_comes_too_late(answers):
    view, reducer = shown("paper-case-1", ticket=2), PremisesReducer(answers.put)
    assert reducer.reduce(PremisesFound(1, ("old",)), view).premises is None
    asked = reducer.reduce(FindPremises(), view)
    assert asked.shown is not None
    newer = replace(asked, shown=Shown(3, asked.shown.result, 0.01))
    assert newer.offers_premises


@pytest.mark.parametrize("name", ["composite-case-2", "spatial-composite"])
def test_nothing_is_offered_where_the_theorems_say_nothing(name):
    assert not shown(name).offers_premises
