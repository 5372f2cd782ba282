"""Dragging the object with the mouse: a force is shown, and becomes a push."""

from __future__ import annotations

import asyncio
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import viser

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Pulse
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.scenario import DragObject, LetGo, Undo
from slipgrasp.web.model.playback import WindowChoice
from slipgrasp.web.model.view import RunStage, Shown, ViewState, show
from slipgrasp.web.scene.dragging import ObjectDrag
from slipgrasp.web.scene.scene import Scene
from slipgrasp.web.session import FIRST_PRESET
from tests.web.reducing import after, view_of


@pytest.fixture
def view(case_2: RunResult) -> ViewState:
    return view_of(case_2)


def test_while_the_object_is_dragged_its_push_is_simulated_and_the_picture_rests_at_its_end(
    view,
) -> None:
    playing = replace(view, playback=replace(view.playback, playing=True))
    dragged = after(playing, DragObject((1.0, 2.0)), DragObject((3.0, -4.0)))
    assert not dragged.playback.playing
    np.testing.assert_array_equal(dragged.sample.external_wrench, [3.0, -4.0, 0.0])
    (push,) = dragged.draft.scenario().pulses
    assert push == Pulse(time=0.5, force=(3.0, -4.0))
    assert dragged.playback.time == push.time + push.duration
    assert after(dragged, DragObject((0.0, 0.0))).draft is view.draft


def test_the_pale_run_of_a_drag_is_the_one_without_the_push(view) -> None:
    first = after(view, DragObject((1.0, 2.0)))
    assert first.editing.ghost_due
    shown = replace(first, editing=replace(first.editing, ghost_due=False))
    assert not after(shown, DragObject((3.0, -4.0))).editing.ghost_due
    assert not after(shown, LetGo((3.0, -4.0))).editing.ghost_due


def test_letting_go_is_a_push_at_the_play_head_which_plays_on_and_can_be_undone(view) -> None:
    playing = replace(view, playback=replace(view.playback, playing=True))
    pushed = after(playing, DragObject((1.0, 2.0)), LetGo((3.0, -4.0)))
    assert pushed.draft.scenario().pulses == (Pulse(time=0.5, force=(3.0, -4.0)),)
    assert pushed.playback.playing and not np.any(pushed.sample.external_wrench)
    assert after(pushed, Undo()).draft == view.draft
    at_rest = after(view, DragObject((1.0, 2.0)))
    assert not at_rest.playback.playing and at_rest.playback.time > 0.5
    let_go = after(at_rest, LetGo((3.0, -4.0))).playback
    assert let_go.playing and let_go.time == 0.5
    assert not after(at_rest, LetGo((0.0, 0.0))).playback.playing


@pytest.mark.parametrize("newtons", [0.3, 3.0, 10.0])
def test_the_first_scenario_stays_held_however_the_object_is_pulled(newtons) -> None:
    """Sixteen directions, at instants from the first to the last second."""
    scenario = load_scenario(FIRST_PRESET)
    for k in range(16):
        angle, time = k * math.pi / 8.0, (5 * k % 16) / 16.0 * scenario.simulation.duration
        force = newtons * math.cos(angle), newtons * math.sin(angle)
        run = simulate(with_values(scenario, {"pulses": [{"time": time, "force": force}]}))
        assert run.metrics.held, (force, time)


def test_no_force_is_no_push_and_a_force_of_another_space_is_none_either(view) -> None:
    for force in ((0.0, 0.0), (1.0, 2.0, 3.0)):
        let_go = after(view, DragObject((1.0, 2.0)), LetGo(force))
        assert let_go.draft == view.draft and let_go.drag is None


def test_a_drag_in_space_has_three_parts(view) -> None:
    held = simulate(with_values(load_scenario("spatial-prism"), {"simulation.duration": 0.6}))
    in_space = replace(view, draft=Draft.from_preset("spatial-prism"), shown=Shown(1, held, 0.0))
    pushed = after(in_space, DragObject((1.0, 0.0, 2.0)), LetGo((1.0, 0.0, 2.0)))
    assert pushed.draft.scenario().pulses[0].force == (1.0, 0.0, 2.0)
    np.testing.assert_array_equal(
        after(in_space, DragObject((1.0, 0.0, 2.0))).sample.external_wrench[:3], [1.0, 0.0, 2.0]
    )


def test_letting_go_keeps_the_time_range_of_the_run_of_the_drag(view) -> None:
    """The run of the last drag is already there: no other follows."""
    dragged = after(replace(view, choice=WindowChoice.SLIP), DragObject((3.0, -4.0)))
    longer = simulate(with_values(view.shown.result.scenario, {"object.mass": 1.1}))
    shown = show(dragged, Shown(2, longer, 0.0), RunStage.SIMULATING, afresh=False)
    assert shown.playback.window != view.playback.window
    assert after(shown, LetGo((3.0, -4.0))).playback.window == shown.playback.window


HELD_AT = np.array([0.3, -0.05, 0.2])


def drag(
    drawn: ObjectDrag,
    phase: str,
    way: tuple[float, float, float],
    drift: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> None:
    """Drags from some place of the object, which has moved meanwhile."""
    event = SimpleNamespace(phase=phase, start_position=HELD_AT + drift, end_position=HELD_AT + way)
    asyncio.run(drawn._hear(event))


@pytest.fixture
def sent() -> list[Intent]:
    return []


@pytest.fixture
def drawn(viewer_server: ViewerServer, view: ViewState, sent: list[Intent]) -> ObjectDrag:
    """Follows the object of a scene."""
    drawn = ObjectDrag(sent.append)
    Scene(viewer_server, drawn).show(view.shown.result)
    return drawn


def forces(
    drawn: ObjectDrag, sent: list[Intent], *ways: tuple[float, float, float]
) -> list[tuple[float, ...]]:
    """With what it is pushed after each of some drags."""
    for way in ways:
        drag(drawn, "start", (0.0, 0.0, 0.0))
        drag(drawn, "end", way)
    return [intent.force for intent in sent if isinstance(intent, LetGo)]


def arrow_of_a_drag(
    viewer_server: ViewerServer, view: ViewState, way: tuple[float, float, float]
) -> viser.ArrowsHandle:
    """The arrow of the force after a drag by some way of the mouse."""
    sent: list[Intent] = []
    drawn = ObjectDrag(sent.append)
    scene = Scene(viewer_server, drawn)
    scene.show(view.shown.result)
    drag(drawn, "start", (0.001, 0.0, 0.0))
    drag(drawn, "update", way)
    drag(drawn, "end", way)
    assert [type(intent) for intent in sent] == [DragObject, DragObject, LetGo]
    assert sent[1].force == sent[2].force
    scene.update(after(view, sent[1]).sample)
    arrow = viewer_server.scene.get_handle_by_name("/hand/plane/push/force")
    assert isinstance(arrow, viser.ArrowsHandle)
    return arrow


def test_the_arrow_of_the_force_is_a_small_part_of_the_way_of_the_mouse(
    viewer_server: ViewerServer, view: ViewState
) -> None:
    tail, head = arrow_of_a_drag(viewer_server, view, (2.0, 0.4, -1.0)).points[0]
    # Two digits of the force, so within a twentieth.
    np.testing.assert_allclose((head - tail)[:2], [0.16, -0.08], rtol=0.05)


def test_the_arrow_of_a_small_force_is_longer_than_its_head(
    viewer_server: ViewerServer, view: ViewState
) -> None:
    arrow = arrow_of_a_drag(viewer_server, view, (0.1, 0.02, -0.05))
    (x, y), length = np.diff(arrow.points[0], axis=0)[0, :2], arrow.head_length
    assert math.hypot(x, y) > 1.5 * length
    assert math.atan2(y, x) == pytest.approx(math.atan2(-0.5, 1.0), abs=0.03)


def test_an_object_that_moves_under_the_mouse_adds_no_force(
    drawn: ObjectDrag, sent: list[Intent]
) -> None:
    way = (0.1, 0.02, -0.05)
    for phase, drift in (("start", 0.0), ("update", 0.0), ("end", 0.3)):
        drag(drawn, phase, way, (drift, 0.0, -drift))
    assert sent[1].force == sent[2].force


def test_what_is_no_number_is_no_force_and_none_is_stronger_than_a_push_may_be(
    drawn: ObjectDrag, sent: list[Intent]
) -> None:
    ways = (math.nan, 0.0, 0.0), (1e9, 0.0, 0.0), (0.0, 0.0, 0.0)
    assert forces(drawn, sent, *ways) == [(0.0, 0.0), (1e4, 0.0), (0.0, 0.0)]


def test_a_force_has_two_digits_of_its_largest_part(drawn: ObjectDrag, sent: list[Intent]) -> None:
    ((right, up),) = forces(drawn, sent, (0.1, 0.0, 0.00081))
    assert right == float(f"{right:.2g}") and round(up, 1) == up
