"""What of a new run is drawn first, and that nothing is drawn twice."""

from __future__ import annotations

from typing import Any

from benchmarks.headless_viewer import HeadlessViewer, session_state
from tests.server.serving import RunningServer

SCENE, CARD, CHARTS, COMPARISON = "scene", "card", "charts", "comparison"


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
    with HeadlessViewer(f"ws://127.0.0.1:{dashboard.port}/") as viewer:
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
    order = [each for each in drawn if each]
    assert {SCENE, CARD, CHARTS} <= set(order[:-1])


def is_comparison(message: dict[str, Any]) -> bool:
    return subject_of(message) == COMPARISON


def is_saved(message: dict[str, Any]) -> bool:
    state = session_state(str(message.get("updates", {}).get("content", "")))
    return state is not None and bool(state["run"])
