"""Choosing a law in the dashboard: its settings come and go with it, as one step of undo."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import CONTROL_LAWS, Change, Scenario
from slipgrasp.core.scenario.law_choice import with_law as core_with_law
from slipgrasp.core.scenario.loading import (
    load_scenario,
    scenario_from_mapping,
    with_values,
)
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.model.draft import Draft, Value
from slipgrasp.web.model.editing import LawNote, Reach
from slipgrasp.web.model.events import events_of
from slipgrasp.web.model.intents.scenario import ChooseReach, Redo, RemoveChange, SetParameter, Undo
from slipgrasp.web.model.laws import law_change_words, with_law
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.panels.controls_panel import ControlsPanel
from slipgrasp.web.panels.scenario_panel import changes_html
from tests.web.reducing import AT_REST, after, at, first_view

pytestmark = pytest.mark.slow

LAW, PERIOD, SAFETY = "controller.kind", "controller.control_period", "controller.grip_safety"
FIRST = Draft.from_preset("paper-case-2")
OTHERS = [kind for kind in CONTROL_LAWS if kind != "theorem-4"]
COMPOSITE = (
    "control every 1 ms, grip safety 1.05, distribution hold, estimates within physical bounds"
)


def view_at(time: float, draft: Draft = FIRST, *, playing: bool = False) -> ViewState:
    return first_view(draft=draft, playback=replace(AT_REST, time=time, playing=playing))


def chosen(view: ViewState, *kinds: str) -> ViewState:
    return after(view, *(SetParameter(LAW, kind) for kind in kinds))


@pytest.mark.parametrize("playing", [False, True])
@pytest.mark.parametrize("kind", OTHERS)
def test_every_law_and_back_is_two_steps_to_the_scenario_as_it_was(
    kind: str, playing: bool
) -> None:
    first = view_at(0.0, playing=playing)
    there = chosen(first, kind)
    assert there.draft.scenario() == core_with_law(FIRST.base, kind)
    back = chosen(there, "theorem-4")
    assert back.draft == FIRST
    assert after(there, Undo()).draft == FIRST
    assert after(back, Undo()).draft == there.draft
    assert after(back, Undo(), Undo(), Redo()).draft == there.draft


@pytest.mark.parametrize("name", ["paper-case-1", "wide-object"])
def test_from_law_to_law_a_scenario_is_what_choosing_the_last_one_alone_gives(name: str) -> None:
    draft = Draft.from_preset(name)
    for kinds in permutations(CONTROL_LAWS, 2):
        for kind in kinds:
            draft = with_law(draft, kind, None)
        assert draft.scenario() == core_with_law(load_scenario(name), kinds[-1])


def test_what_the_user_set_stays_and_what_came_with_a_law_goes() -> None:
    own: dict[str, Value] = {"object.mass": 1.2, SAFETY: 1.3}
    draft = Draft("paper-case-2", FIRST.base, edits=own)
    composite = with_law(draft, "composite", 0.0)
    assert composite.value_at(0.0, SAFETY) == 1.3
    assert composite.value_at(0.0, PERIOD) == 0.001
    assert with_law(composite, "theorem-4", 0.0) == draft
    tuned = with_law(composite.edited(PERIOD, 0.002), "theorem-4", 0.0)
    assert tuned.edits == {**own, PERIOD: 0.002}


def test_while_the_run_plays_a_law_acts_on_all_of_it() -> None:
    paused = chosen(view_at(0.08), "composite")
    playing = chosen(view_at(0.05, paused.draft, playing=True), "pd-gravity")
    assert playing.draft.scenario() == core_with_law(FIRST.base, "pd-gravity")
    whole = chosen(after(view_at(0.08), ChooseReach(Reach.WHOLE_RUN)), "composite")
    assert whole.draft.scenario() == core_with_law(FIRST.base, "composite")


@pytest.mark.parametrize("kind", OTHERS)
def test_at_a_play_head_a_law_changes_with_its_settings_and_goes_back_with_them(kind: str) -> None:
    first = view_at(0.08)
    there = chosen(first, kind)
    scenario = there.draft.scenario()
    assert {change.time for change in scenario.changes} == {0.08}
    assert there.draft.edits == {}
    then = {change.parameter: change.value for change in scenario.changes}
    assert with_values(FIRST.base, then) == core_with_law(FIRST.base, kind)
    assert chosen(there, "theorem-4").draft == FIRST
    assert after(there, Undo()).draft == FIRST
    assert after(there, RemoveChange(0.08, LAW)).draft == FIRST


@pytest.mark.parametrize(("one", "other"), [*permutations(CONTROL_LAWS, 2)])
def test_laws_follow_each_other_in_any_order_and_the_scenario_stays_valid(
    one: str, other: str
) -> None:
    view = view_at(0.5)
    for time, kind in ((0.5, one), (0.5, other), (2.0, one), (0.2, other), (0.0, one)):
        view = chosen(at(view, time), kind)
        assert valid(view.draft).controller.kind in ("theorem-4", one)
    taken = after(view, RemoveChange(0.2, LAW))
    assert valid(taken.draft)
    assert valid(chosen(at(taken, 0.0), "theorem-4").draft)


def valid(draft: Draft) -> Scenario:
    return scenario_from_mapping(draft.scenario().to_mapping())


def test_a_later_law_keeps_the_sampled_control_that_an_earlier_one_brought() -> None:
    view = chosen(view_at(0.0), "composite")
    view = chosen(at(view, 2.0), "grip-reflex")
    assert [change.key for change in view.draft.changes] == [LAW]
    view = chosen(at(view, 0.0), "theorem-4")
    assert view.draft.edits == {}
    assert view.draft.scenario().changes == (
        Change(time=2.0, parameter=LAW, value="grip-reflex"),
        Change(time=2.0, parameter=PERIOD, value=0.001),
    )


def test_while_another_control_is_wrong_a_law_is_still_chosen_with_its_settings() -> None:
    wrong = FIRST.edited("object.mass", -1.0)
    there = chosen(view_at(0.0, wrong), "composite").draft
    assert there.edited("object.mass", 1.0).scenario() == core_with_law(FIRST.base, "composite")


@pytest.mark.parametrize("value", ["nonsense", 3.0, None, ["composite"]])
def test_what_is_no_law_chooses_nothing(value: Value) -> None:
    first = view_at(0.0)
    assert after(first, SetParameter(LAW, value)) is first


def test_the_note_says_what_actually_changed_until_the_next_step() -> None:
    first = view_at(0.0)
    there = chosen(first, "composite")
    assert there.editing.law_note == LawNote("composite", COMPOSITE, 0.0)
    back = chosen(there, "theorem-4").editing.law_note
    words = "continuous control, grip safety 1, distribution exact, estimates without bounds"
    assert back == LawNote("theorem-4", words, 0.0)
    assert chosen(first, "pd-gravity").editing.law_note == LawNote("pd-gravity", "", 0.0)
    assert after(there, Undo()).editing.law_note is None
    assert after(there, SetParameter("object.mass", 1.1)).editing.law_note is None
    assert chosen(view_at(0.08), "composite").editing.law_note == LawNote(
        "composite", COMPOSITE, 0.08
    )


def test_the_note_stands_below_the_control_of_the_law(viewer_server: ViewerServer) -> None:
    panel = ControlsPanel(viewer_server.gui, lambda _: None)
    first = view_at(0.0)
    panel.update(first)
    assert panel.law_line == ""
    panel.update(chosen(first, "composite"))
    told = panel.law_line.replace("\u00a0", " ")
    assert f"<b>composite</b> on the whole run: {COMPOSITE}; undo with Ctrl+Z." in told
    assert panel.control("estimates.3.maximum").value == "0.2"
    panel.update(chosen(view_at(0.08), "pd-gravity"))
    assert "<b>pd-gravity</b> from t = 0.08 s on: no other setting changed" in panel.law_line
    panel.update(first)
    assert panel.law_line == ""
    assert panel.control("estimates.3.maximum").value == ""


def test_a_law_and_its_settings_are_one_event_of_the_run() -> None:
    draft = chosen(view_at(0.08), "composite").draft.edited("simulation.duration", 0.1)
    texts = [event.text for event in events_of(simulate(draft.scenario())) if event.time == 0.08]
    assert texts == [f"the control law becomes composite: {COMPOSITE}"]


def test_a_law_and_its_settings_are_one_line_among_the_changes() -> None:
    draft = chosen(view_at(0.08), "composite").draft
    assert len(draft.changes) == 12
    assert law_change_words(draft, draft.changes[0]) == f"composite: {COMPOSITE}"
    html = changes_html(draft)
    assert html.count("<b>0.08 s</b>") == 1
    assert f"<b>0.08 s</b> composite: {COMPOSITE}" in html
    assert "remove all" not in html
    more = changes_html(draft.edited_from(0.08, "object.mass", 1.4).edited_from(0.1, SAFETY, 1.2))
    assert [more.count(words) for words in ("0.08 s</b>", "0.1 s</b>", "remove all")] == [2, 1, 1]
