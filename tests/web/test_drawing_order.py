"""What of a new run is drawn first, and that nothing is drawn twice."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import pytest

from benchmarks.headless_viewer import HeadlessViewer, session_state
from slipgrasp.server.viewer.server import MessageBuffer
from tests.server.serving import RunningServer

SCENE, CARD, CHARTS, COMPARISON, SENT = "scene", "card", "charts", "comparison", "sent"
LAYOUT = {"width": 1440, "height": 900, "scene_width": 740, "scene_height": 900, "covered": 220}


class Editor(HeadlessViewer):
    """A viewer that moves controls, whose ids it learns from the messages that add them."""

    def __init__(self, url: str) -> None:
        self._uuids: dict[str, str] = {}
        super().__init__(url)

    def measure_page(self) -> None:
        """Reports the size of the page, after which the session sends all controls."""
        self.post(kind="measure-page", layout=LAYOUT, prefers_dark=False)

    def set(self, label: str, value: object) -> None:
        """Moves the control with a label."""
        self.send("GuiUpdateMessage", {"uuid": self._uuids[label], "updates": {"value": value}})

    def receive(self) -> Iterator[dict[str, Any]]:
        for message in super().receive():
            properties = message.get("props", {})
            if isinstance(properties, dict) and properties.get("label"):
                self._uuids[properties["label"]] = message["uuid"]
            yield message


def subject_of(message: dict[str, Any]) -> str:
    updates = message.get("updates", {})
    content = str(updates.get("content", ""))
    if message.get("name") == "/close-ups":
        return SCENE
    if "sg-verdict" in content:
        return CARD
    if "sg-compare" in content:
        return COMPARISON
    return CHARTS if "data" in updates else ""


def test_view_card_and_charts_of_a_run_come_before_what_is_out_of_sight(
    dashboard: RunningServer,
) -> None:
    with Editor(f"ws://127.0.0.1:{dashboard.port}/") as viewer:
        viewer.measure_page()
        awaited = {is_saved, is_comparison}

        def is_complete(message: dict[str, Any]) -> bool:
            awaited.difference_update([each for each in awaited if each(message)])
            return not awaited

        viewer.wait_for(is_complete)
        drawn = list[str]()

        def is_compared(message: dict[str, Any]) -> bool:
            drawn.append(subject_of(message))
            return drawn[-1] == COMPARISON

        viewer.set("mass [kg]", 1.3)
        viewer.wait_for(is_compared)
    assert {SCENE, CARD, CHARTS} <= set(drawn[:-1])


@pytest.fixture
def order(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is drawn and sent, in this order."""
    done, push, flush = list[str](), MessageBuffer.push, MessageBuffer.flush

    def watched_push(buffer: MessageBuffer, message: Any) -> None:
        if subject := subject_of(asdict(message)):
            done.append(subject)
        push(buffer, message)

    def watched_flush(buffer: MessageBuffer) -> None:
        done.append(SENT)
        flush(buffer)

    monkeypatch.setattr(MessageBuffer, "push", watched_push)
    monkeypatch.setattr(MessageBuffer, "flush", watched_flush)
    return done


def test_view_words_and_charts_of_a_run_are_sent_together(
    dashboard: RunningServer, order: list[str]
) -> None:
    """A page that gets the view alone draws it before it takes the charts, which are then late."""
    with Editor(f"ws://127.0.0.1:{dashboard.port}/") as viewer:
        viewer.measure_page()
        viewer.wait_for(is_saved)
        order.clear()
        viewer.set("mass [kg]", 1.3)
        viewer.wait_for(lambda message: subject_of(message) == CHARTS)
    assert SENT not in order[order.index(SCENE) : order.index(CARD)]
    assert SENT not in order[order.index(SCENE) : order.index(CHARTS)]


def is_comparison(message: dict[str, Any]) -> bool:
    return subject_of(message) == COMPARISON


def is_saved(message: dict[str, Any]) -> bool:
    state = session_state(str(message.get("updates", {}).get("content", "")))
    return state is not None and bool(state["run"])
