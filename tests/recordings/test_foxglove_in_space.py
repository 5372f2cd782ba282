"""A spatial hand as Foxglove shows it is that of the trace.

Frames come from the reference hand of the tests, which shares no code with what is tested.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings import palette
from slipgrasp.recordings.file.writer import write_recording
from tests.recordings.reading_display import matrix, placed, read_shown, shown_rows
from tests.references.spatial_plant import State
from tests.references.spatial_scenarios import world_of

NEAR = 1e-9  # the simulator's own inverse kinematics [m]
RUNS = {
    "spatial-pyramid": {"simulation.duration": 0.15},
    "spatial-box": {
        "simulation.duration": 0.15,
        "trajectory.start": [0.02, -0.01, 0.37, 0.98, 0.1, -0.1, 0.14],
    },
}


class Display:
    """A run, its samples that are shown, what was read of them, and where things are."""

    def __init__(self, run, path):
        self.run, self.samples = run, shown_rows(run)
        self.n = len(run.scenario.fingers)
        self.shown = read_shown(path)
        self.hand = world_of(run.scenario).hand

    def kinematics(self, row):
        samples, n = self.samples, self.n
        pose, slip = samples.object_pose[row], samples.slip[row].reshape(n, 2)
        velocity = samples.slip_velocity[row].reshape(n, 2)
        return self.hand.kinematics(
            State(pose[:3], pose[3:], samples.object_velocity[row], slip, velocity)
        )

    def instants(self):
        for row, shown in enumerate(self.shown):
            yield row, shown, self.kinematics(row)


@pytest.fixture(scope="module", params=RUNS)
def display(request, tmp_path_factory):
    run = simulate(with_values(load_scenario(request.param), RUNS[request.param]))
    path = tmp_path_factory.mktemp("recording") / "run.mcap"
    write_recording(run, path)
    return Display(run, path)


def test_object_and_desired_pose_are_those_of_the_trace(display):
    for row, shown, kin in display.instants():
        pose = shown.pose("object", "world")
        assert_allclose(pose[:3, 3], display.samples.object_pose[row, :3], atol=1e-15)
        assert_allclose(pose[:3, :3], kin.rotation, atol=1e-12)
        desired, error = shown.pose("desired", "world"), display.samples.tracking_error[row]
        assert_allclose(desired[:3, 3] - pose[:3, 3], error[:3], atol=1e-15)
        turned = Rotation.from_matrix(desired[:3, :3] @ pose[:3, :3].T)
        assert_allclose(turned.as_rotvec(), error[3:], atol=1e-9)


def test_the_chain_of_every_finger_leads_to_its_contact(display):
    """The joint angles from the one side, pose and slip from the other."""
    for row, shown, kin in display.instants():
        centre = display.samples.object_pose[row, :3]
        for i in range(display.n):
            tip, contact = (
                shown.pose(frame, "world") for frame in (f"finger_{i}/tip", f"contact_{i}")
            )
            assert_allclose(tip[:3, 3], contact[:3, 3], atol=NEAR)
            assert_allclose(contact[:3, 3], centre + kin.arms[i], atol=NEAR)
            # C_i, in whose axes the force on the object counts.
            assert_allclose(contact[:3, :3], kin.frames[i], atol=1e-12)
            base = shown.pose(f"finger_{i}/base", "world")
            assert_allclose(base[:3, 3], display.run.scenario.fingers[i].base, atol=1e-15)
            # The last link lies along x, from the joint to the tip.
            link = shown.pose(f"finger_{i}/link_1", "world")
            length = display.run.scenario.fingers[i].link_lengths[1]
            assert_allclose(tip[:3, 3] - link[:3, 3], length * link[:3, 0], atol=1e-12)


def test_arrows_are_the_forces_on_the_object_at_one_scale_in_the_colour_of_the_phase(display):
    scales = []
    for row, shown, kin in display.instants():
        for i in range(display.n):
            entity = shown.entities[f"contact_{i}"]
            (arrow,) = entity.arrows
            length = arrow.shaft_length + arrow.head_length
            pose = matrix(arrow.pose.position, arrow.pose.orientation)
            ends = placed(
                shown.pose(entity.frame_id, "world"), placed(pose, np.eye(3)[:1] * length)
            )
            across = display.samples.tangential_force[row, 2 * i : 2 * i + 2]
            force = kin.frames[i] @ np.append(across, display.samples.normal_force[row, i])
            tail = display.samples.object_pose[row, :3] + kin.arms[i]
            size = np.linalg.norm(force)
            assert_allclose((ends[0] - tail) / length, force / size, atol=1e-7)
            scales.append(length / size)
            colour = palette.PHASES[ContactPhase(int(display.samples.phase[row, i]))]
            for paint in (arrow.color, entity.spheres[0].color):
                told = [255.0 * part for part in (paint.r, paint.g, paint.b)]
                assert_allclose(told, colour, atol=1e-9)
    assert_allclose(scales, scales[0], rtol=1e-12)


def test_cone_and_pyramid_open_by_the_friction_and_trails_start_at_the_first_touch(display):
    for row, shown, _ in display.instants():
        for i in range(display.n):
            entity = shown.entities[f"contact_{i}"]
            friction = display.samples.friction_coefficient[row, i]
            if display.run.scenario.friction_cone == "pyramid":
                ends = [(p.x / p.z, p.y / p.z) for p in entity.lines[0].points[1:]]
                signs = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
                assert_allclose(ends, friction * np.array(signs), rtol=1e-12)
            else:
                (cone,) = entity.cylinders
                assert (cone.bottom_scale, cone.top_scale) == (0.0, 1.0)
                assert cone.pose.position.z == pytest.approx(0.5 * cone.size.z)
                assert cone.size.x == cone.size.y == pytest.approx(2 * friction * cone.size.z)
            touched = entity.lines[-1].points[0]
            pose = shown.pose("object", "world")
            first = placed(shown.pose(entity.frame_id, "world"), [touched.x, touched.y, 0.0])
            anchor = np.linalg.inv(pose) @ np.append(first, 1.0)
            begin = display.shown[0]
            frame = np.linalg.inv(begin.pose("object", "world")) @ begin.pose(
                entity.frame_id, "world"
            )
            assert not display.samples.slip[0].any()
            assert_allclose(anchor[:3], frame[:3, 3], atol=1e-12)


def test_the_object_has_its_faces_and_edges(display):
    body = display.run.scenario.object
    shown = display.shown[0].entities["object"]
    (solid,), (edges,) = shown.triangles, shown.lines
    points = np.array([[p.x, p.y, p.z] for p in solid.points])
    triangles = points[np.array(solid.indices).reshape(-1, 3)]
    # By Gauss's theorem, with all triangles seen from outside.
    volume = np.linalg.det(triangles).sum() / 6.0
    base = np.array(body.corners or [(1, 1), (-1, 1), (-1, -1), (1, -1)], float)
    if not body.corners:
        base *= (body.half_width, body.half_depth)
    x, y = base.T
    area = 0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum()
    assert volume == pytest.approx(area * body.height, rel=1e-12)
    assert len(edges.indices) == 2 * 3 * len(base)
