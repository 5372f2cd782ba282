"""A run of a spatial hand as a file: read back, verified, drawn."""

import io
import json

import numpy as np
import pytest
from mcap.reader import make_reader
from PIL import Image

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.geometry import contact_frame, outline
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.figures.animation import write_gif
from slipgrasp.figures.drawings import draw_figures
from slipgrasp.figures.hand_motion import motion_of
from slipgrasp.figures.still import write_png
from slipgrasp.figures.trends import trends_of
from slipgrasp.recordings.clip import Clip
from slipgrasp.recordings.compare.verification import verify
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.palette import OBJECT_EDGE, PHASES
from slipgrasp.recordings.still import Still
from slipgrasp.web.charts.replay_page import write_html
from tests.planar_joints import joint_points
from tests.recordings.reading_figures import axes_of, titles


@pytest.fixture(scope="module")
def run():
    scenario = with_values(load_scenario("spatial-prism"), {"simulation.duration": 0.12})
    return simulate(scenario)


@pytest.fixture
def path(run, tmp_path):
    path = tmp_path / "run.mcap"
    write_recording(run, path)
    return path


def test_it_is_read_back_as_it_was_and_verified_bit_for_bit(run, path):
    read = read_recording(path)
    assert read.scenario == run.scenario
    assert np.array_equal(read.trace.to_rows(), run.trace.to_rows())
    assert read.phase_changes == run.phase_changes
    assert read.metrics == run.metrics
    assert read.trace.absent == frozenset()
    found = verify(read)
    assert found.same and found.bit_for_bit


def test_it_says_what_its_own_parameters_mean(path):
    with path.open("rb") as stream:
        attached = {each.name: each.data for each in make_reader(stream).iter_attachments()}
    described = json.loads(attached["parameters.json"])
    assert described["object.height"]["unit"] == "m"
    assert "object.inertia" not in described


def test_its_numerics_have_a_name_of_their_own(run):
    planar = simulate(with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.01}))
    assert run.provenance.kernel != planar.provenance.kernel
    assert run.provenance.is_portable


def test_its_figures_show_ways_on_faces_and_friction_within_its_disc(run):
    figures = draw_figures(run)
    assert list(figures) == ["slips", "tracking", "estimates", "forces", "premises"]
    for i in range(3):
        way = axes_of(figures["slips"], f"way {i + 1}")
        end = way.lines[-1].get_xydata()[0]
        np.testing.assert_allclose(end, 1e3 * run.trace.slip[-1, [2 * i + 1, 2 * i]])
        stick, slip, *_ = (
            np.hypot(*np.asarray(line.get_xydata()).T)
            for line in axes_of(figures["slips"], f"friction {i + 1}").lines[2:]
        )
        assert np.nanmax(stick) < 1.0
        np.testing.assert_allclose(slip[np.isfinite(slip)], 1.0, rtol=1e-9)
    assert titles(figures["tracking"])[0] == "(a) object position error"
    assert len(titles(figures["forces"])) == 6


def test_its_trends_beside_another_run_are_ways_and_six_errors(run):
    columns = [line.column for trend in trends_of(run, run) for line in trend.lines]
    assert columns[:3] == ["slip_path_0", "slip_path_1", "slip_path_2"]
    assert columns[9:15] == [f"error_{name}" for name in run.trace.shape.coordinates]


def test_moving_pictures_lay_it_flat_in_one_scale(run):
    """By a parallel projection: midpoints stay midpoints, and what is upright stays upright."""
    motion = motion_of(run, np.array([0.0, 0.06]))
    below, above = motion.edges[:, :3, 0], motion.edges[:, 3:6, 0]
    rise = above - below
    np.testing.assert_allclose(rise, np.broadcast_to(rise[:, :1], rise.shape), atol=1e-12)
    assert abs(rise[0, 0, 0]) < 1e-12
    assert rise[0, 0, 1] == pytest.approx(0.3 * np.cos(np.radians(24.0)))
    # Fingertips on the middles of the side faces, where those are not hidden by their slip.
    middles = 0.25 * (below + above + np.roll(below, -1, axis=1) + np.roll(above, -1, axis=1))
    np.testing.assert_allclose(motion.joints[0, :, -1], middles[0], atol=1e-9)
    slip = motion.joints[1, :, -1] - middles[1]
    # All tips have slid up by what the trace says, seen under the same angle.
    spatial_rise = run.trace.slip[np.searchsorted(run.trace.times, 0.06), 0::2]
    np.testing.assert_allclose(slip[:, 1], np.cos(np.radians(24.0)) * spatial_rise, atol=5e-5)


def test_its_gif_and_its_still_are_not_empty(run):
    film, still = io.BytesIO(), io.BytesIO()
    write_gif(run, film, fps=2.0, clip=Clip(end=0.1, speed=0.1))
    write_png(run, still, Still(time=0.06))
    colours = np.unique(np.asarray(Image.open(still)).reshape(-1, 3), axis=0)
    assert {PHASES[ContactPhase.SLIP], OBJECT_EDGE} <= {tuple(c) for c in colours.tolist()}
    assert Image.open(film).n_frames == 3


def test_its_scene_plays_as_a_page(run):
    page = io.BytesIO()
    write_html(run, page, fps=1.0, clip=Clip(end=0.1))
    assert b"<title>spatial-prism" in page.getvalue()


def test_a_planar_hand_is_laid_flat_by_the_same_code_and_seen_from_the_front():
    run = simulate(with_values(load_scenario("tilted-object"), {"simulation.duration": 0.1}))
    motion = motion_of(run, run.trace.times[-1:])
    x, y, angle = run.trace.object_pose[-1]
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    seen = {tuple(corner) for corner in motion.corners[0].round(9).tolist()}
    expected = (np.array([x, y]) + outline(run.scenario.object) @ turn.T).round(9)
    assert seen == {tuple(corner) for corner in expected.tolist()}
    assert not motion.behind.any()
    for i, finger in enumerate(run.scenario.fingers):
        points = joint_points(finger, run.trace.joint_position[-1].reshape(-1, 2)[i])
        np.testing.assert_allclose(motion.joints[0, i], points, atol=1e-12)
        frame = contact_frame(run.scenario.object, finger)
        np.testing.assert_allclose(motion.normals[0, i], turn @ frame.normal, atol=1e-12)
        normal, across = run.trace.normal_force[-1, i], run.trace.tangential_force[-1, i]
        force = turn @ (normal * np.array(frame.normal) - across * np.array(frame.tangent))
        np.testing.assert_allclose(motion.forces[0, i], force, atol=1e-9)
