"""What the page makes of a run in space: instants, charts, words and the picture."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import PHASES
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.charts.charts import charts_of
from slipgrasp.web.model.events import events_of, phases_in
from slipgrasp.web.model.playback import TimeWindow
from slipgrasp.web.model.sampling import Sampler
from slipgrasp.web.model.view import Shown
from slipgrasp.web.panels.playback_panel import caption_html
from slipgrasp.web.panels.strip import phase_spans
from slipgrasp.web.scene.layout import lay_out
from slipgrasp.web.scene.scene import Scene
from slipgrasp.web.scene.view_plane import ViewPlane

OBJECT = "/space/object"
DURING, AFTER = 0.05, 0.19


@pytest.fixture(scope="module")
def prism() -> RunResult:
    """The first fifth of a second: all fingertips slip for some 80 ms."""
    return simulate(with_values(load_scenario("spatial-prism"), {"simulation.duration": 0.2}))


def node(server: ViewerServer, name: str) -> Any:
    found = server.scene.get_handle_by_name(name)
    assert found is not None, name
    return found


def test_an_instant_is_read_between_two_rows_and_ends_every_way_at_its_slip(
    prism: RunResult,
) -> None:
    sampler = Sampler(prism.trace)
    sample, trace = sampler.at(DURING + 0.0011), prism.trace
    for i, way in enumerate(sample.trails):
        np.testing.assert_array_equal(way[0], 0.0)
        np.testing.assert_array_equal(way[-1], sample.states.slip[0, i])
        length = np.linalg.norm(np.diff(way, axis=0), axis=1).sum()
        told = np.interp(sample.time, trace.times, trace.slip_path[:, i])
        assert length == pytest.approx(told, rel=1e-3)
    turned = Rotation.from_quat(sample.states.object_pose[0, [4, 5, 6, 3]])
    error = np.array(
        [np.interp(sample.time, trace.times, column) for column in trace.tracking_error.T]
    )
    desired = Rotation.from_rotvec(error[3:]) * turned
    wanted = sample.states.desired_pose[0, [4, 5, 6, 3]]
    np.testing.assert_allclose(
        (desired.inv() * Rotation.from_quat(wanted)).magnitude(), 0.0, atol=1e-12
    )


def test_the_first_look_is_upright_and_from_outside(prism: RunResult) -> None:
    plane = lay_out(prism).plane
    axes = np.array(plane)
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert plane.right[2] == 0.0
    assert plane.towards[2] > 0.0
    point = np.array([0.3, -0.2, 0.5])
    across, up = plane.project(point)
    depth = float(point @ np.array(plane.towards))
    np.testing.assert_allclose(plane.place((across, up), depth), point, atol=1e-12)
    front = ViewPlane.seen_from(-np.pi / 2, 0.0)
    np.testing.assert_allclose(front.right, (1.0, 0.0, 0.0), atol=1e-12)


def test_charts_show_both_slips_and_their_limits(prism: RunResult) -> None:
    charts = {chart.key: chart for tab in charts_of(prism).values() for chart in tab}
    trace = prism.trace
    slips = [line.values for line in charts["slip"].lines]
    np.testing.assert_allclose(slips, 1e3 * trace.slip.T[[0, 2, 4, 1, 3, 5]])
    assert [line.dashed for line in charts["slip"].lines] == [False] * 3 + [True] * 3
    forces = charts["forces"].lines
    for i in range(3):
        size = np.hypot(*trace.tangential_force.T[2 * i : 2 * i + 2])
        np.testing.assert_allclose(forces[i].values, size)
        # The first row is that before the contacts are asked: they stick, and cannot.
        after = slice(1, None)
        assert np.all(forces[i].values[after] <= forces[3 + i].values[after] * (1.0 + 1e-9))
    assert [line.label for line in charts["position-error"].lines] == ["x", "y", "z"]
    assert len(charts["turn-error"].lines) == 3
    assert len(charts["torques"].lines) == 9


def test_events_say_where_a_fingertip_slips_and_lanes_show_it(prism: RunResult) -> None:
    texts = [event.text for event in events_of(prism)]
    assert sum("starts to slip up on its face" in text for text in texts) == 3
    assert sum("sticks again" in text for text in texts) == 3
    assert phases_in(prism.scenario) == (ContactPhase.STICK, ContactPhase.SLIP)
    for i in range(3):
        spans = list(phase_spans(prism, i, TimeWindow(0.0, 0.2)))
        assert [phase for _, _, phase in spans] == [ContactPhase.SLIP, ContactPhase.STICK]


def test_the_pad_of_a_soft_fingertip_is_a_disc_whose_hand_turns_with_it(
    viewer_server: ViewerServer, prism: RunResult
) -> None:
    run = simulate(with_values(load_scenario("parallel-gripper"), {"simulation.duration": 0.6}))
    scene, sampler, pad = Scene(viewer_server), Sampler(run.trace), 0.015
    scene.show(run)
    for time in (0.0, 0.55):
        sample = sampler.at(time)
        scene.update(sample)
        spin = float(sample.states.spin[0, 0])
        _, end = node(viewer_server, f"{OBJECT}/contact0/tip/pad-hand").points[0]
        # Seen from outside a positive spin is clockwise.
        clock = np.array([np.cos(spin), np.sin(spin)])
        np.testing.assert_allclose(end[:2], -1.35 * pad * clock, atol=1e-6)
    assert abs(spin) > 0.2
    pad_node = f"{OBJECT}/contact0/tip/pad"
    assert tuple(node(viewer_server, pad_node).color) == PHASES[ContactPhase.SLIP]
    scene.show(prism)
    scene.update(Sampler(prism.trace).at(DURING))
    assert viewer_server.scene.get_handle_by_name(pad_node) is None


def test_friction_has_a_square_in_the_pyramid_on_the_face(
    viewer_server: ViewerServer, prism: RunResult
) -> None:
    scene = Scene(viewer_server)
    scene.show(prism)
    values = {"simulation.duration": 0.06}
    run = simulate(with_values(load_scenario("spatial-pyramid"), values))
    scene.show(run)
    sample = Sampler(run.trace).at(DURING)
    scene.update(sample)
    rays = node(viewer_server, f"{OBJECT}/contact0/tip/cone/edges").points
    *across, height = np.moveaxis(rays[-48:], -1, 0)
    limit = float(sample.states.friction[0, 0]) * height
    np.testing.assert_allclose(np.abs(across).max(axis=0), limit, rtol=2e-2)
    assert "friction pyramid" in caption_html(Shown(1, run, 0.01), None, 0.0)
    assert "friction cone" in caption_html(Shown(1, prism, 0.01), None, 0.0)


def test_a_run_in_the_plane_takes_the_place_of_one_in_space(
    viewer_server: ViewerServer, prism: RunResult, case_2: RunResult
) -> None:
    scene = Scene(viewer_server)
    scene.show(prism)
    scene.update(Sampler(prism.trace).at(DURING))
    scene.show(case_2, ghost=prism)
    scene.update(Sampler(case_2.trace).at(DURING))
    assert viewer_server.scene.get_handle_by_name("/space") is None
    assert viewer_server.scene.get_handle_by_name("/pale-space") is None
    scene.show(prism, ghost=prism)
    scene.update(Sampler(prism.trace).at(DURING), Sampler(prism.trace).at(AFTER))
    assert viewer_server.scene.get_handle_by_name("/hand") is None
    assert node(viewer_server, "/pale-space").visible
    assert isinstance(prism.scenario, SpatialScenario)


def test_a_low_friction_patch_lies_on_its_face_while_it_is_there(
    viewer_server: ViewerServer, prism: RunResult
) -> None:
    wet = with_values(
        prism.scenario,
        {
            "patches.0.face": "side-0",
            "patches.0.centre.0": 0.14,
            "patches.0.radius": 0.02,
            "patches.0.end_time": AFTER,
            "patches.1.face": "side-0",
        },
    )
    run = replace(prism, scenario=wet)
    scene, sampler = Scene(viewer_server), Sampler(prism.trace)
    scene.show(run)
    on_face = f"{OBJECT}/wet0"
    for time, there in ((DURING, True), (AFTER, False)):
        scene.update(sampler.at(time))
        assert node(viewer_server, on_face).visible is there
    # The face ends 1 cm above the middle of the spot, right and up are its axes x and z.
    water = node(viewer_server, f"{on_face}/water").vertices
    assert water[:, 2].max() == pytest.approx(0.01) and water[:, 2].min() == pytest.approx(-0.02)
