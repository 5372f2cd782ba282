"""The laws side by side, and what the card suggests as buttons."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.hints import does_what_it_says
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.trying import try_hint
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.custom_laws import law_names
from slipgrasp.core.scenario.law_choice import LAW, choose_law
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.words.options import Option
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.server.runs.service import RunService
from slipgrasp.web.charts.law_charts import LAWS_TAB, law_charts_html, laws_html
from slipgrasp.web.model.hints import HintTrials, followed
from slipgrasp.web.model.intents.hints import HintTried, TryHints
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.laws import LawRunFinished
from slipgrasp.web.model.intents.scenario import ChooseLaw, TryOut, Undo
from slipgrasp.web.model.laws import with_law
from slipgrasp.web.model.laws_view import LawRun, LawsView
from slipgrasp.web.model.parameter_names import in_page_words
from slipgrasp.web.model.playback import TimeWindow
from slipgrasp.web.model.view import RunStage, RunStatus, Shown, ViewState
from slipgrasp.web.panels.laws_tab import known_words
from slipgrasp.web.panels.outcome_panel import outcome_html
from slipgrasp.web.reducers.hints import REST as HINTS_REST
from slipgrasp.web.reducers.hints import HintsReducer
from slipgrasp.web.reducers.laws import REST, LawsReducer
from slipgrasp.web.reducers.scenario import ScenarioReducer
from tests.server.serving import patient_settings
from tests.waiting import wait_until
from tests.web.test_charts_panel import view_of
from tests.web.test_xy_charts import path_of

PREVIEW = RunStatus(RunStage.PREVIEW)
QUICK = {"simulation.duration": 0.05}


def seen(view: ViewState) -> ViewState:
    return replace(view, charts=view.charts.with_tab_seen(LAWS_TAB, is_visible=True))


def quick_view(result: RunResult) -> ViewState:
    view = view_of(result)
    return replace(view, draft=replace(view.draft, edits=QUICK))


def runs_of(view: ViewState, reducer: LawsReducer, sent: list[Intent]) -> ViewState:
    wait_until(lambda: len(sent) == len(law_names()), "not every law was run")
    for intent in sent:
        view = reducer.reduce(intent, view)
    return view


def test_every_law_is_run_once_with_its_settings_while_looked_at(
    store: RecordingStore, case_2: RunResult, tmp_path: Path
) -> None:
    sent: list[Intent] = []
    service = RunService(store, patient_settings(tmp_path / "data"))
    reducer = LawsReducer(service, sent.append)
    view = quick_view(case_2)
    assert reducer.pass_time(0.0, view) is view and reducer.wait(0.0, view) is None
    view = seen(view)
    assert reducer.wait(0.0, view) == pytest.approx(REST)
    view = reducer.pass_time(REST, view)
    shown = runs_of(view, reducer, sent)
    assert [run.kind for run in shown.laws.runs] == list(law_names())
    for run in shown.laws.runs:
        expected = simulate(with_law(view.draft, run.kind, None).scenario())
        assert run.result is not None
        np.testing.assert_array_equal(run.result.trace.slip, expected.trace.slip)
    assert reducer.wait(1.0, shown) is None
    late = LawRunFinished(99, LawRun("theorem-3", case_2))
    assert reducer.reduce(late, shown) is shown
    for worker in reducer.workers:
        worker.close()


def test_a_law_that_a_scenario_does_not_allow_is_named_with_the_reason() -> None:
    view = LawsView().with_run(LawRun("one", None, "not with <this>"))
    html = laws_html(view.runs, "two", dark=False)
    assert "not with &lt;this&gt;" in html and "<button" not in html


def test_lines_of_laws_hold_what_their_runs_do(case_1: RunResult, case_2: RunResult) -> None:
    runs = (LawRun("one", case_1), LawRun("two", None, "why"), LawRun("three", case_2))
    html = law_charts_html(runs, TimeWindow(0.0, 0.1), dark=False)
    slip, offset, force = html.split("<svg")[1:]
    assert len(path_of(slip, 0)) > 10
    for svg in (slip, offset, force):
        # Both reach from one side of the frame to the other.
        ends = [path_of(svg, curve)[[0, -1], 0].tolist() for curve in (0, 1)]
        assert ends == 2 * [[52.0, 330.0]]
    # Case II slips farther than case I: its line ends higher.
    assert path_of(slip, 1)[-1, 1] < path_of(slip, 0)[-1, 1]


def test_a_law_is_taken_on_the_whole_run_and_taken_back(case_2: RunResult) -> None:
    view = view_of(case_2)
    taken = ScenarioReducer().reduce(ChooseLaw("composite"), view)
    assert taken.draft == with_law(view.draft, "composite", None)
    assert taken.draft.changes == ()
    assert ScenarioReducer().reduce(Undo(), taken).draft == view.draft
    assert ScenarioReducer().reduce(ChooseLaw("no such law"), view) is view


def tried_on(view: ViewState) -> ViewState:
    """The view after the hint of its run was tried on its draft."""
    assert view.shown is not None
    result = view.shown.result

    def follow(option: Option) -> Scenario:
        return followed(view.draft, option).scenario()

    tried = try_hint(result, describe_run(result).hint, follow_option=follow)
    return replace(view, hint_trials=HintTrials(view.draft, tried))


def card_of(view: ViewState) -> str:
    return outcome_html(view.status, view.shown, tried=view.hint_trials.of(view.draft))


def test_what_the_card_suggests_is_a_button_that_does_what_it_says_and_is_taken_back(
    case_2: RunResult,
) -> None:
    view = tried_on(view_of(case_2))
    tried, card = view.hint_trials.tried, card_of(view)
    assert tried is not None
    assert card.count("&quot;try-out&quot;") == len(tried.helpful) == 3
    for each in tried.helpful:
        assert each.effect in card
        label = in_page_words(each.option.label, case_2.scenario)
        after = ScenarioReducer().reduce(TryOut(label), view)
        run = simulate(after.draft.scenario())
        assert does_what_it_says(each.effect, case_2, run, tried.hint.goal)
        assert ScenarioReducer().reduce(Undo(), after).draft == view.draft
    assert ScenarioReducer().reduce(TryOut("raise everything"), view) is view


def test_a_law_that_the_card_suggests_is_one_step_of_undo_with_all_its_settings(
    case_1: RunResult,
) -> None:
    view = tried_on(view_of(case_1))
    tried = view.hint_trials.tried
    assert tried is not None
    option = next(each.option for each in tried.helpful if LAW in each.option.values)
    label = in_page_words(option.label, case_1.scenario)
    after = ScenarioReducer().reduce(TryOut(label), view)
    assert after.draft == followed(view.draft, option)
    assert after.editing.law_note is not None and after.editing.law_note.kind == "composite"
    assert ScenarioReducer().reduce(Undo(), after).draft == view.draft


def test_before_it_was_tried_a_hint_is_told_without_buttons(case_2: RunResult) -> None:
    view = view_of(case_2)
    assert "&quot;try-out&quot;" not in card_of(view) and "<b>Try:</b>" in card_of(view)
    # What was tried on another draft is no promise for this one.
    tried = tried_on(view)
    edited = replace(tried, draft=replace(view.draft, edits={"object.mass": 2.0}))
    assert "&quot;try-out&quot;" not in card_of(edited)
    label = "position gain Kₚ: 100 → 200 1/s²"
    assert label in card_of(tried)
    assert ScenarioReducer().reduce(TryOut(label), edited) is edited


def test_what_is_left_besides_the_buttons_is_told_in_words() -> None:
    loose = {"controller.kind": "pd-gravity", "controller.grip_force": 1.0}
    view = view_of(simulate(with_values(load_scenario("paper-case-2"), loose)))
    card = card_of(tried_on(view))
    assert "<b>Try to stop the slip earlier:</b>" in card
    assert card.count("&quot;try-out&quot;") >= 1
    assert "Or use a longer face (object face half length)." in card


def test_the_card_says_what_was_given_and_in_bold_where_that_was_everything(
    case_2: RunResult,
) -> None:
    shown = Shown(1, case_2, 0.1)
    assert "<p class='sg-small'>Unknown to the controller: " in outcome_html(PREVIEW, shown)
    blind = with_values(replace(load_scenario("paper-case-2"), estimates=()), QUICK)
    html = outcome_html(PREVIEW, replace(shown, result=simulate(blind)))
    assert "<b>The controller was given the true friction and mass at every instant" in html
    assert html.count("The controller was given") == 1


def test_laws_on_a_scenario_without_unknowns_are_said_to_compare_nothing_of_adaptation() -> None:
    scenario = replace(load_scenario("paper-case-2"), estimates=())
    told = known_words(choose_law(scenario, "pd-gravity").scenario)
    assert told.startswith("The controller was given the true friction and mass")
    assert told.endswith("This comparison compares no adaptation.")
    assert "nothing of adaptation" not in known_words(load_scenario("paper-case-2"))


def test_the_hint_of_a_run_is_tried_once_it_rests(
    store: RecordingStore, case_2: RunResult, tmp_path: Path
) -> None:
    sent: list[Intent] = []
    service = RunService(store, patient_settings(tmp_path / "data"))
    reducer, view = HintsReducer(service, sent.append), view_of(case_2)
    assert view.shown is not None
    view = replace(view, ticket=view.shown.ticket, status=RunStatus(RunStage.PREVIEW))
    # Nothing is tried for a read-only viewer.
    assert reducer.pass_time(0.0, view) is view and reducer.wait(0.0, view) is None
    assert reducer.reduce(TryHints(), view) is view
    assert reducer.wait(0.0, view) == pytest.approx(HINTS_REST)
    asked = reducer.pass_time(HINTS_REST, view)
    assert asked.hint_trials.of(asked.draft) is None and reducer.wait(1.0, asked) is None
    wait_until(lambda: bool(sent), "nothing was tried")
    (answer,) = sent
    assert isinstance(answer, HintTried)
    assert reducer.reduce(replace(answer, number=99), asked) is asked
    told = reducer.reduce(answer, asked)
    assert told.hint_trials == HintTrials(view.draft, tried_on(view).hint_trials.tried)
    # A slider moves: what was found is void at once, and nothing is tried until it rests.
    moved = replace(told, draft=quick_view(case_2).draft, ticket=told.ticket + 1)
    after = reducer.pass_time(9.0, moved)
    assert after.hint_trials == HintTrials() and reducer.wait(9.0, after) is None
    assert reducer.reduce(answer, after) is after
    for worker in reducer.workers:
        worker.close()
