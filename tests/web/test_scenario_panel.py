"""What stands above the controls: where they act, what changes during the run, files."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Any

import viser

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.loading import all_preset_names
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.editing import Editing, Reach
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.scenario import ChoosePreset, ChooseReach, ResetScenario, Undo
from slipgrasp.web.model.playback import Playback
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.view import Ghost, Shown, ViewState
from slipgrasp.web.panels.scenario_file_panel import ScenarioFilePanel, file_errors_html
from slipgrasp.web.panels.scenario_panel import ScenarioPanel, changes_html, ghost_html, reach_html
from tests.web.reducing import AT_REST, first_view

MASS = "object.mass"


def at(time: float, *, playing: bool = False) -> Playback:
    return replace(AT_REST, time=time, playing=playing)


def view_of(draft: Draft) -> ViewState:
    return first_view(draft=draft, playback=AT_REST)


def touch(target: Any, value: str) -> None:
    """Does what viser does when a browser sends a value."""
    target._impl.value = value
    event = viser.GuiEvent(client=None, client_id=7, target=target)
    for callback in target._impl.update_cb:
        asyncio.run(callback(event))


def test_the_note_says_what_a_control_acts_on_now() -> None:
    assert "from 0.05 s on" in reach_html(Reach.PLAY_HEAD, at(0.05))
    assert "on the whole run" in reach_html(Reach.PLAY_HEAD, at(0.05, playing=True))
    assert "on the whole run" in reach_html(Reach.PLAY_HEAD, at(0.0))
    assert "on the whole run" in reach_html(Reach.WHOLE_RUN, at(0.05))


def test_timed_changes_are_listed_with_a_button_each() -> None:
    draft = Draft.from_preset("paper-case-1").edited_from(0.05, MASS, 1.4)
    one = changes_html(draft)
    assert "<b>0.05 s</b> object mass 1.4 kg" in one
    assert "&quot;kind&quot;: &quot;remove-change&quot;, &quot;time&quot;: 0.05" in one
    assert "remove all" not in one
    assert "remove all" in changes_html(draft.edited_from(0.1, MASS, 1.5))
    assert changes_html(draft.without_changes()) == ""


def test_nothing_that_a_user_typed_becomes_markup() -> None:
    hostile = "<img src=x onerror=alert(1)>"
    draft = Draft.from_preset("paper-case-1").edited_from(0.05, MASS, hostile)
    assert "<img" not in changes_html(draft)
    error = FieldError(field=hostile, value=hostile, limit=hostile, message=hostile)
    assert "<img" not in file_errors_html((error,))


def test_a_ghost_can_be_dismissed(case_1: RunResult) -> None:
    html = ghost_html(Ghost(Shown(1, case_1, 0.0), "before <the> change"))
    assert "Ghost: before &lt;the&gt; change" in html
    assert "&quot;kind&quot;: &quot;end-comparison&quot;" in html
    assert ghost_html(None) == ""


def test_what_the_user_does_becomes_an_intent_and_what_the_program_does_not(
    viewer_server: ViewerServer,
) -> None:
    sent: list[Intent] = []
    draft = Draft.from_preset("paper-case-1")
    panel = ScenarioPanel(viewer_server.gui, draft, sent.append)
    view = view_of(Draft.from_preset("paper-case-2"))
    panel.update(replace(view, editing=Editing(reach=Reach.WHOLE_RUN)))
    assert (panel.origin.value, panel.reach.value) == ("paper-case-2", "on the whole run")
    assert sent == []
    touch(panel.origin, "paper-case-1")
    touch(panel.reach, "at the play head")
    touch(panel.steps, "↶ undo")
    touch(panel.steps, "reset")
    touch(panel.steps, "no such button")
    assert sent == [
        ChoosePreset("paper-case-1"),
        ChooseReach(Reach.PLAY_HEAD),
        Undo(),
        ResetScenario(),
    ]


def test_a_recording_and_a_file_stay_among_the_scenarios_to_choose(
    viewer_server: ViewerServer, case_1: RunResult
) -> None:
    replay = Replay("mine", "today", case_1)
    draft = Draft.starting_from("file own.toml", case_1.scenario)
    panel = ScenarioPanel(viewer_server.gui, draft, lambda _: None)
    view = replace(view_of(draft), replay=replay, from_file=draft)
    panel.update(view)
    assert panel.origin.value == "file own.toml"
    panel.update(replace(view, draft=Draft.from_preset("paper-case-2")))
    assert panel.origin.value == "paper-case-2"
    assert set(panel.origin.options) == {"file own.toml", "recording mine", *all_preset_names()}


def test_a_file_is_saved_only_once_there_is_a_run(
    viewer_server: ViewerServer, case_1: RunResult
) -> None:
    panel = ScenarioFilePanel(viewer_server.gui, lambda _: None)
    view = view_of(Draft.from_preset("paper-case-1"))
    panel.update(view)
    assert panel.save.disabled
    panel.update(replace(view, shown=Shown(1, case_1, 0.01)))
    assert not panel.save.disabled


def test_what_is_wrong_with_a_file_is_a_list_with_field_and_limit(
    viewer_server: ViewerServer,
) -> None:
    errors = tuple(
        FieldError(field=f"field.{i}", value=i, limit="1 … 2 m", message=f"wrong {i}")
        for i in range(20)
    )
    panel = ScenarioFilePanel(viewer_server.gui, lambda _: None)
    view = view_of(Draft.from_preset("paper-case-1"))
    panel.update(replace(view, editing=Editing(file_errors=errors)))
    assert "<code>field.3</code>: wrong 3" in panel.errors.content
    assert "Allowed: 1 … 2 m." in panel.errors.content
    assert "and 8 more" in panel.errors.content
    panel.update(view)
    assert panel.errors.content == ""


def test_the_hint_of_the_scenario_says_what_it_shows(viewer_server: ViewerServer) -> None:
    draft = Draft.from_preset("paper-case-2")
    panel = ScenarioPanel(viewer_server.gui, draft, lambda _: None)
    panel.update(view_of(draft))
    assert panel.origin.hint == draft.base.title
