"""What the scene puts on a real viewer's stage, and what it sends for a frame."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import viser

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.palette import PHASES
from slipgrasp.scene import parts, skeleton
from slipgrasp.scene.rotations import about_z, matrices
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.sampling import Sampler
from slipgrasp.web.model.surfaces import surfaces_for
from slipgrasp.web.scene.close_ups import PACKET
from slipgrasp.web.scene.scene import Scene
from tests.held_polygon import CORNERS, held_polygon
from tests.web.packets import unpacked

MOST_UPDATES = 36


def node(server: ViewerServer, name: str) -> Any:
    found = server.scene.get_handle_by_name(name)
    assert found is not None, name
    return found


@pytest.fixture
def scene(viewer_server: ViewerServer) -> Scene:
    return Scene(viewer_server)


@pytest.fixture(scope="module")
def heavier(case_2: RunResult) -> RunResult:
    return simulate(with_values(case_2.scenario, {"object.mass": 1.4}))


@contextmanager
def counting(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Any]]:
    """Collects the messages that a block puts on the way."""
    sent: list[Any] = []
    original = viser.SceneApi._queue_scene_message

    def count(api: viser.SceneApi, message: Any) -> None:
        sent.append(message)
        original(api, message)

    with monkeypatch.context() as patch:
        patch.setattr(viser.SceneApi, "_queue_scene_message", count)
        yield sent


def sent_for_close_ups(server: ViewerServer) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """What the page is sent for its close-ups."""
    sent = server._websock_server.get_message_buffer().message_from_id.values()
    updates = [
        m.updates for m in sent if getattr(m, "name", "") == PACKET and hasattr(m, "updates")
    ]
    return unpacked(updates[-1]["points"].tobytes())


def force_length(server: ViewerServer) -> float:
    points = node(server, "/hand/plane/object/contact0/tip/arrows").points
    return float(np.linalg.norm(points[0, 1] - points[0, 0]))


def test_the_marks_have_the_colour_of_their_phase(
    scene: Scene, viewer_server: ViewerServer, case_2: RunResult
) -> None:
    scene.show(case_2)
    for time in (0.05, 6.0):
        sample = Sampler(case_2.trace).at(time)
        scene.update(sample)
        for i, phase in enumerate(sample.states.phases[0]):
            ball = node(viewer_server, f"/hand/plane/object/contact{i}/tip/ball")
            assert tuple(ball.color) == PHASES[phase]


def test_the_force_scale_lengthens_the_arrows_and_nothing_else(
    scene: Scene, viewer_server: ViewerServer, case_2: RunResult
) -> None:
    sample, lengths, slips = Sampler(case_2.trace).at(0.05), [], []
    for scale in (1.0, 2.0):
        scene.show(case_2, appearance=Appearance(force_scale=scale))
        scene.update(sample)
        lengths.append(force_length(viewer_server))
        slips.append(node(viewer_server, "/hand/plane/object/contact0/tip").position.tolist())
    assert lengths[1] == pytest.approx(2.0 * lengths[0])
    assert slips[0] == slips[1]


def test_what_is_switched_off_is_hidden(
    scene: Scene, viewer_server: ViewerServer, case_2: RunResult
) -> None:
    for shown in (False, True):
        scene.show(case_2, appearance=Appearance(cones=shown, lenses=shown))
        assert node(viewer_server, "/hand/plane/object/contact0/tip/cone").visible is shown
        facts, _ = sent_for_close_ups(viewer_server)
        assert (facts["visible"], facts["cones"]) == (shown, shown)


def test_a_dark_scene_keeps_the_colours_of_the_phases(
    scene: Scene, viewer_server: ViewerServer, case_2: RunResult
) -> None:
    scene.show(case_2, appearance=Appearance(dark=True))
    scene.update(Sampler(case_2.trace).at(0.05))
    ball, bar = (
        "/hand/plane/object/contact0/tip/ball",
        "/hand/plane/finger_0-base/finger_0-link_0/part0",
    )
    assert tuple(node(viewer_server, ball).color) in PHASES.values()
    assert tuple(node(viewer_server, bar).color) == surfaces_for(dark=True).link


def test_all_entities_of_a_frame_are_drawn(
    scene: Scene, viewer_server: ViewerServer, case_2: RunResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    entities = parts.entities_of(case_2.scenario)
    mount = next(each for each in entities if each.frame == skeleton.base_frame(0))
    monkeypatch.setattr(parts, "entities_of", lambda _: [*entities, mount])
    scene.show(case_2)
    for k in range(2 * len(mount.shapes)):
        node(viewer_server, f"/hand/plane/finger_0-base/part{k}")


def test_the_pale_run_stands_where_it_is_and_goes_when_it_is_dismissed(
    scene: Scene, viewer_server: ViewerServer, case_2: RunResult, heavier: RunResult
) -> None:
    shown, other = Sampler(case_2.trace).at(2.0), Sampler(heavier.trace).at(2.0)
    scene.show(case_2, heavier)
    scene.update(shown, other)
    place = node(viewer_server, "/ghost/plane/edges").position
    assert place[:2] == pytest.approx(other.states.object_pose[0, :2])
    _, arrays = sent_for_close_ups(viewer_server)
    slip = heavier.trace.slip.astype(np.float32)
    np.testing.assert_array_equal(arrays["ghostSlip"][..., 0], slip)
    scene.show(case_2)
    scene.update(shown)
    assert not node(viewer_server, "/ghost").visible
    assert "ghostSlip" not in sent_for_close_ups(viewer_server)[1]


def test_a_pale_hand_of_another_shape_has_nodes_of_its_own(
    scene: Scene, viewer_server: ViewerServer, case_2: RunResult, heavier: RunResult
) -> None:
    def width() -> float:
        return float(np.ptp(node(viewer_server, "/ghost/plane/edges").points[..., 0]))

    scene.show(case_2, heavier)
    scene.update(Sampler(case_2.trace).at(0.0), Sampler(heavier.trace).at(0.0))
    before = width()
    wider = with_values(case_2.scenario, {"object.half_width": 0.06})
    other = replace(heavier, scenario=wider)
    scene.show(case_2, other)
    scene.update(Sampler(case_2.trace).at(1.0), Sampler(other.trace).at(1.0))
    assert width() == pytest.approx(0.12, rel=1e-3)
    assert before != pytest.approx(0.12, rel=1e-3)


def test_a_frame_sends_little_and_the_same_frame_nothing(
    scene: Scene, case_2: RunResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    sampler = Sampler(case_2.trace)
    scene.show(case_2)
    scene.update(sampler.at(0.05))
    with counting(monkeypatch) as sent:
        scene.update(sampler.at(0.052))
    assert 5 < len(sent) <= MOST_UPDATES
    with counting(monkeypatch) as again:
        scene.update(sampler.at(0.052))
    assert again == []


def test_a_moving_picture_leaves_out_what_nobody_sees_and_one_at_rest_is_exact(
    scene: Scene,
    viewer_server: ViewerServer,
    case_2: RunResult,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sampler = Sampler(case_2.trace)
    scene.show(case_2)
    scene.update(sampler.at(0.05), moving=True)
    with counting(monkeypatch) as sent:
        scene.update(sampler.at(0.05002), moving=True)
    tip = node(viewer_server, "/hand/plane/object/contact0/tip")
    hardly_moved = np.array(tip.position)
    assert len(sent) < MOST_UPDATES / 3
    scene.update(sampler.at(0.05002))
    exact = np.array(tip.position)
    assert 0.0 < np.abs(exact - hardly_moved).max() <= 1e-3
    rested = Scene(viewer_server)
    rested.show(case_2)
    rested.update(sampler.at(0.05002))
    np.testing.assert_array_equal(
        node(viewer_server, "/hand/plane/object/contact0/tip").position, exact
    )


@pytest.fixture(scope="module")
def polygon() -> RunResult:
    return simulate(held_polygon())


def test_a_polygon_is_drawn_with_its_corners_and_a_ghost_of_it_too(
    scene: Scene, viewer_server: ViewerServer, polygon: RunResult
) -> None:
    layout = scene.show(polygon, polygon)
    sample = Sampler(polygon.trace).at(0.05)
    scene.update(sample, sample)
    drawn = np.unique(node(viewer_server, "/hand/plane/object/part0").vertices[:, :2], axis=0)
    np.testing.assert_allclose(drawn, np.unique(CORNERS, axis=0), atol=1e-6)
    (x, y), angle = sample.states.object_pose[0, :2], about_z(sample.states.object_pose[0, 3:])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    edges = node(viewer_server, "/ghost/plane/edges")
    pale = edges.points[: len(CORNERS), 0] @ matrices(edges.wxyz[None])[0].T + edges.position
    np.testing.assert_allclose(pale[:, :2], CORNERS @ turn.T + (x, y), atol=1e-6)
    plane = matrices(node(viewer_server, "/ghost/plane").wxyz[None])[0]
    np.testing.assert_allclose(plane @ [x, y, 0.0], [x, 0.0, y], atol=1e-12)
    assert (layout.low < np.array(CORNERS) + sample.states.object_pose[0, :2]).all()
    assert (layout.hand[1] > np.array(CORNERS) + sample.states.object_pose[0, :2]).all()


def test_a_low_friction_patch_lies_on_its_face_and_in_the_close_up_while_it_is_there(
    scene: Scene, viewer_server: ViewerServer, polygon: RunResult
) -> None:
    scene.show(polygon)
    sampler, spot = Sampler(polygon.trace), node(viewer_server, "/hand/plane/object/wet0")
    for time, there in ((0.01, False), (0.03, True), (0.09, True)):
        scene.update(sampler.at(time))
        assert spot.visible is there
    facts, _ = sent_for_close_ups(viewer_server)
    ((patch,), *others) = (each["patches"] for each in facts["contacts"])
    assert others == [[]] * len(others)
    assert 0.01 < patch["start"] <= 0.03
    assert patch["radius"] == pytest.approx(0.02)
    band = node(viewer_server, "/hand/plane/object/wet0/water").vertices[:, [0, 2]]
    start, end = np.array(CORNERS[5]), np.array(CORNERS[0])
    along = (band - 0.5 * (start + end)) @ (end - start) / np.hypot(*(end - start))
    assert np.abs(along).max() == pytest.approx(0.02, abs=1e-6)


def test_a_push_is_an_arrow_to_the_centre_and_a_twist_an_arc_while_they_last(
    scene: Scene, viewer_server: ViewerServer, polygon: RunResult
) -> None:
    scene.show(polygon)
    sampler = Sampler(polygon.trace)
    for time, acts in ((0.01, False), (0.04, True), (0.07, False)):
        scene.update(sampler.at(time))
        assert node(viewer_server, "/hand/plane/push").visible is acts
    scene.update(sampler.at(0.04))
    (arrow,) = node(viewer_server, "/hand/plane/push/force").points
    way = (arrow[1] - arrow[0])[:2]
    np.testing.assert_allclose(way / np.hypot(*way), (0.6, -0.8), atol=1e-6)
    np.testing.assert_allclose(arrow[1], 0.0, atol=1e-6)
    assert node(viewer_server, "/hand/plane/push/moment").visible
    assert node(viewer_server, "/hand/plane/push/words").text == "push 5 N, 0.1 N m"


def test_other_low_friction_patches_take_the_place_of_those_before(
    scene: Scene, viewer_server: ViewerServer, polygon: RunResult
) -> None:
    scene.show(polygon)
    scene.show(replace(polygon, scenario=replace(polygon.scenario, patches=())))
    assert viewer_server.scene.get_handle_by_name("/hand/plane/object/wet0") is None


@pytest.mark.parametrize(
    ("preset", "shape", "mark"),
    [
        ("paper-case-1", "circle", "/hand/plane/object/contact0/tip"),
        ("spatial-box", "cylinder", "/space/object/contact0/tip"),
        ("spatial-box", "sphere", "/space/object/contact0/tip"),
    ],
)
def test_a_fingertip_is_drawn_turned_where_it_is_on_a_round_object(
    scene: Scene, viewer_server: ViewerServer, preset: str, shape: str, mark: str
) -> None:
    values = {"object.shape": shape, "simulation.duration": 0.1}
    run = simulate(with_values(load_scenario(preset), values))
    radius = run.scenario.object.radius
    slips = np.zeros_like(run.trace.slip)
    slips[:, run.scenario.space.num_tangents - 1] = 0.5 * radius
    run = replace(run, trace=replace(run.trace, slip=slips))
    scene.show(run)
    scene.update(Sampler(run.trace).at(0.05))
    tip = node(viewer_server, mark)
    angle = 0.5 if shape != "sphere" else 2.0 * np.arctan(0.25)
    assert 2.0 * np.arccos(tip.wxyz[0]) == pytest.approx(angle)
    inward = 2 if shape != "circle" else 1
    assert tip.position[inward] == pytest.approx(radius * (1.0 - np.cos(angle)))
    trail = node(viewer_server, f"{mark.removesuffix('/tip')}/trail").points
    assert np.isfinite(trail).all()


def test_the_server_keeps_no_copy_of_the_close_ups_and_the_links(
    viewer_server: ViewerServer,
) -> None:
    """Each session of a spatial hand would hold some 350 kB."""
    Scene(viewer_server).show(simulate(load_scenario("spatial-prism")))
    assert node(viewer_server, PACKET).points.nbytes == 0
    handles = viewer_server.scene._handle_from_node_name.values()
    meshes = [each for each in handles if isinstance(each, viser.MeshHandle)]
    assert sum(mesh.vertices.nbytes + mesh.faces.nbytes for mesh in meshes) < 20_000
