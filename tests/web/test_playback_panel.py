"""The panel of the play head, what the page is told, and its keys, without a browser."""

from __future__ import annotations

import json
from dataclasses import replace
from html import unescape
from xml.etree import ElementTree

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.model.intents.compare import SwapRuns
from slipgrasp.web.model.intents.playback import Seek, SetSpeed, Step, TogglePlay
from slipgrasp.web.model.playback import Playback, WindowChoice, start_playback, whole_window
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.view import Ghost, RunStage, RunStatus, Shown, ViewState
from slipgrasp.web.page.intents_schema import PageGestures, posted
from slipgrasp.web.page.keys import KEYS, keys_html, keys_of
from slipgrasp.web.panels.playback_panel import PlaybackPanel, caption_html, transport_html
from slipgrasp.web.panels.session_state_panel import SessionStatePanel, linked_run
from tests.web.reducing import view_of


@pytest.fixture
def view(case_2: RunResult) -> ViewState:
    return view_of(
        case_2,
        status=RunStatus(RunStage.SAVED, run_id="abcdefghijkl"),
        choice=WindowChoice.SLIP,
        playback=replace(start_playback(case_2), playing=False),
    )


def playback_of(view: ViewState) -> Playback:
    assert view.playback is not None
    return view.playback


def asked_by(html: str, attribute: str) -> list[str]:
    """What the elements of some HTML post, as JSON."""
    return [unescape(part.partition('"')[0]) for part in html.split(f'{attribute}="')[1:]]


def test_a_moving_play_head_sends_neither_strip_nor_controls_again(
    viewer_server: ViewerServer, view: ViewState
) -> None:
    panel = PlaybackPanel(viewer_server.gui, lambda _: None)
    panel.update(view)
    before = panel.strip.content, panel.transport.content
    panel.update(replace(view, playback=replace(playback_of(view), time=0.1)))
    assert (panel.strip.content, panel.transport.content) == before


def test_a_run_without_slip_is_shown_whole(viewer_server: ViewerServer, view: ViewState) -> None:
    panel = PlaybackPanel(viewer_server.gui, lambda _: None)
    whole = replace(playback_of(view), window=whole_window(view.shown.result))
    panel.update(replace(view, playback=whole))
    assert 'aria-pressed="true" title="Shows the run' in panel.transport.content
    assert 'aria-pressed="false" title="Shows the time range' in panel.transport.content


def test_where_the_run_comes_from_and_the_pale_run_are_named_and_escaped(
    viewer_server: ViewerServer, view: ViewState, case_1: RunResult
) -> None:
    panel = PlaybackPanel(viewer_server.gui, lambda _: None)
    panel.update(view)
    assert "Live run" in panel.strip.content
    hostile = "<img src=x>"
    replay = Replay(hostile, "long ago", case_1)
    shown = Shown(2, case_1, 0.0, replay)
    panel.update(replace(view, shown=shown, ghost=Ghost(shown, hostile)))
    assert "<img" not in panel.strip.content
    assert panel.strip.content.count("&lt;img") == 4  # each in a tooltip, too


def test_the_legend_names_the_directions_of_slip_by_what_is_seen(
    case_1: RunResult,
) -> None:
    legend = caption_html(Shown(1, case_1, 0.0), None, 0.0)
    assert "</i> slips clockwise</span>" in legend
    assert "</i> slips counterclockwise</span>" in legend


@pytest.mark.parametrize("playing", [True, False])
def test_every_button_asks_for_something_that_the_session_knows(
    view: ViewState, playing: bool
) -> None:
    html = transport_html(replace(playback_of(view), playing=playing), WindowChoice.CLOSER)
    asked = [json.loads(text) for text in asked_by(html, "data-sg-intent")]
    assert len(asked) == 11
    assert len(PageGestures.model_validate(asked).intents()) == 11


def test_a_typed_time_and_a_chosen_speed_become_intents(view: ViewState) -> None:
    html = transport_html(playback_of(view), WindowChoice.SLIP)
    texts = asked_by(html, "data-sg-change")
    typed = json.loads(texts[0].replace('"$value"', "0.25"))
    chosen = json.loads(texts[1].replace("$value", "1/16"))
    assert PageGestures.model_validate([typed, chosen]).intents() == [Seek(0.25), SetSpeed("1/16")]


def test_every_key_asks_for_something_that_the_session_knows_and_none_is_taken_twice() -> None:
    keys = [key for command in KEYS for key in command.keys]
    assert len(set(keys)) == len(keys)
    for start in range(0, len(KEYS), 20):
        asked = [posted(command.intent) for command in KEYS[start : start + 20]]
        assert len(PageGestures.model_validate(asked).intents()) == len(asked)


def test_the_table_of_keys_reaches_the_script_as_it_is() -> None:
    element = ElementTree.fromstring(keys_html())
    rows = json.loads(element.text or "")
    assert [tuple(row["keys"]) for row in rows] == [command.keys for command in KEYS]
    assert [row["intent"] for row in rows] == [posted(command.intent) for command in KEYS]
    assert keys_of(TogglePlay()) == "Space or P"
    assert keys_of(Step(-1)) == "←"
    with pytest.raises(LookupError, match="no key does"):
        keys_of(SwapRuns())


def test_the_session_state_tells_all_the_script_needs_and_is_quiet_while_nothing_changes(
    viewer_server: ViewerServer, view: ViewState
) -> None:
    panel = SessionStatePanel(viewer_server.gui, "secret")
    panel.update(view)
    first, playback = told_by(panel), playback_of(view)
    assert first == {
        "session": "secret",
        "ready": True,
        "shows": True,
        "charts": "",
        "run": "abcdefghijkl",
        "notice": "",
        "lecture": False,
        "time": playback.time,
        "start": playback.window.start,
        "end": playback.window.end,
        "duration": 7.0,
        "speed": playback.speed,
        "pace": None,
        "playing": False,
    }
    playing = replace(playback_of(view), playing=True)
    panel.update(replace(view, playback=playing))
    assert told_by(panel)["playing"] is True
    panel.update(replace(view, playback=playing.advance(0.03)))
    assert told_by(panel)["time"] == playing.time
    panel.update(replace(view, notice="<b>words</b>", playback=playing.advance(0.06)))
    assert told_by(panel)["notice"] == "<b>words</b>" and "<b>" not in panel.session_state.content


def told_by(panel: SessionStatePanel) -> dict[str, object]:
    element = ElementTree.fromstring(panel.session_state.content.replace(" hidden", ""))
    told: dict[str, object] = json.loads(element.get("data-sg-state", ""))
    return told


def test_only_a_stored_run_can_be_linked(view: ViewState, case_2: RunResult) -> None:
    assert linked_run(view) == "abcdefghijkl"
    assert linked_run(replace(view, status=RunStatus(RunStage.PREVIEW))) == ""
    replay = Replay("name", "long ago", case_2, "zyxwvutsrqpo")
    status = RunStatus(RunStage.REPLAY)
    assert linked_run(replace(view, shown=Shown(3, case_2, 0.0, replay), status=status)) == (
        "zyxwvutsrqpo"
    )
