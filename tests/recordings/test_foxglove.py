"""Hand, object and contacts as Foxglove shows them are those of the trace.

The expected places come from the reference hand of the tests, which shares no code with
what is tested; the topics are read by the mcap library with the schemas that lie in the file.
"""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Change
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings import palette
from slipgrasp.recordings.file.foxglove.layouts import display_layouts
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.scene.states import states_of
from tests.held_polygon import held_polygon
from tests.recordings.reading_display import matrix, placed, read_shown, read_topic, shown_rows
from tests.references.closed_loop import ClosedLoop
from tests.references.hands import random_scenario

PHASES = {
    0: palette.PHASES[ContactPhase.STICK],
    1: palette.PHASES[ContactPhase.SLIP_FORWARD],
    -1: palette.PHASES[ContactPhase.SLIP_BACKWARD],
}
NEAR = 1e-9  # the simulator's own inverse kinematics, through metres of links [m]


class Display:
    """A run, its samples that are shown, what was read of them, and the reference hand."""

    def __init__(self, run, path):
        self.run = run
        self.samples = shown_rows(run)
        self.hand = ClosedLoop.from_scenario(run.scenario).hand
        self.transforms, self.scenes = read_topic(path, "/tf"), read_topic(path, "/scene")
        self.shown = read_shown(path)

    def instants(self):
        """Pairs of a row of the trace and what is shown of it."""
        return zip(range(len(self.samples)), self.shown, strict=True)

    def contacts(self):
        """What is shown of each contact at each instant, with its row and index."""
        for row, shown in self.instants():
            for i in range(self.samples.shape.num_contacts):
                yield row, i, shown, shown.entities[f"contact_{i}"]


def turning_run():
    """Fingers above and below an object that turns while they slip."""
    mapping = random_scenario(np.random.default_rng(18), 4, "nothing").to_mapping()
    fingers = [{**finger, "friction": 0.4} for finger in mapping["fingers"][2:]]
    controller = {"grasp_force": "minimum", "velocity_gain": 12.0, "lyapunov_weight": 10.0}
    mapping |= {
        "fingers": fingers,
        "controller": {**mapping["controller"], "kind": "theorem-4", **controller},
        "trajectory": {**mapping["trajectory"], "acceleration": (0.2, 0.1, 4.0)},
        "estimates": [{"parameter": f"fingers.{i}.friction", "initial": 0.8} for i in (0, 1)],
        "simulation": {**mapping["simulation"], "duration": 0.5},
    }
    return simulate(scenario_from_mapping(json.loads(json.dumps(mapping))))


@pytest.fixture(scope="module", params=["slipping", "lost", "turning", "polygon"])
def display(request, tmp_path_factory, short_run, lost_run):
    runs = {"slipping": short_run, "lost": lost_run}
    made = {"turning": turning_run, "polygon": lambda: simulate(held_polygon())}
    run = runs[request.param] if request.param in runs else made[request.param]()
    path = tmp_path_factory.mktemp("display") / "run.mcap"
    write_recording(run, path)
    return Display(run, path)


def test_the_runs_that_are_compared_slip_both_ways_turn_and_touch_all_faces(short_run, lost_run):
    turning = turning_run()
    runs = (short_run, lost_run, turning)
    assert all(len(shown_rows(run)) >= 5 for run in runs)
    assert set(np.unique(shown_rows(short_run).phase)) == {-1, 0, 1}
    faces = {finger.face for run in runs for finger in run.scenario.fingers}
    assert faces == {"left", "right", "bottom", "top"}
    assert np.ptp(turning.trace.object_pose[:, 2]) > 0.2
    assert {finger.elbow for finger in turning.scenario.fingers} == {"up", "down"}


def test_every_sample_that_is_shown_is_one_message_of_its_time_on_each_topic(display):
    expected = [round(t * 1e9) for t in display.samples.times]
    for name, read in (
        ("foxglove.FrameTransforms", display.transforms),
        ("foxglove.SceneUpdate", display.scenes),
    ):
        assert {schema.name for schema, *_ in read} == {name}
        assert {schema.encoding for schema, *_ in read} == {"protobuf"}
        records = [record for _, _, record, _ in read]
        assert [record.log_time for record in records] == expected
        assert [record.publish_time for record in records] == expected
        assert [record.sequence for record in records] == list(range(len(expected)))
        assert len({len(record.data) for record in records}) == 1


def test_every_transform_and_entity_carries_the_time_of_its_message(display):
    for shown in display.shown:
        for part in (*shown.frames.values(), *shown.entities.values()):
            assert part.timestamp.seconds * 10**9 + part.timestamp.nanos == shown.time


def test_the_frames_are_one_tree_below_the_world(display):
    fingers = len(display.run.scenario.fingers)
    parts = ("base", "link_0", "link_1", "tip")
    expected = {"plane", "object", "desired", *(f"contact_{i}" for i in range(fingers))}
    expected |= {f"finger_{i}/{part}" for i in range(fingers) for part in parts}
    for shown in display.shown:
        assert set(shown.frames) == expected
        for frame in shown.frames:
            assert np.isfinite(shown.pose(frame, "world")).all()


def test_the_plane_stands_upright_and_is_seen_from_the_front(display):
    pose = display.shown[0].pose("plane", "world")
    x, y, z = pose[:3, :3].T
    np.testing.assert_allclose(x, [1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(y, [0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(z, [0, -1, 0], atol=1e-15)
    assert not pose[:3, 3].any()


def test_contact_frames_are_at_the_fingertips_with_their_axes_along_the_model_s(display):
    for row, shown in display.instants():
        pose = display.samples.object_pose[row]
        tips = display.hand.tip_positions(pose, display.samples.slip[row])
        c, s = math.cos(pose[2]), math.sin(pose[2])
        for i, (tip, tangent) in enumerate(zip(tips, display.hand.tangents, strict=True)):
            frame = shown.pose(f"contact_{i}")
            t = np.array([[c, -s], [s, c]]) @ tangent
            assert shown.frames[f"contact_{i}"].parent_frame_id == "object"
            np.testing.assert_allclose(frame[:2, 3], tip, atol=1e-14)
            np.testing.assert_allclose(frame[:2, 0], -t, atol=1e-14)  # x_c = -t
            np.testing.assert_allclose(frame[:2, 1], [t[1], -t[0]], atol=1e-14)  # n
            np.testing.assert_allclose(frame[2], [0, 0, 1, 0], atol=1e-14)
            np.testing.assert_allclose(shown.pose(f"finger_{i}/tip")[:2, 3], tip, atol=NEAR)


def test_entities_keep_their_ids_follow_a_frame_that_exists_and_never_expire(display):
    ids = list(display.shown[0].entities)
    for shown, (*_, scene) in zip(display.shown, display.scenes, strict=True):
        assert [entity.id for entity in scene.entities] == ids
        assert len(scene.deletions) == 0
        for entity in scene.entities:
            assert entity.frame_id in shown.frames
            assert entity.frame_locked
            assert (entity.lifetime.seconds, entity.lifetime.nanos) == (0, 0)


def corners_of(body):
    """Corners of the object, anticlockwise, read off the scenario alone."""
    x, y = body.half_width, body.face_half_length
    return np.array(body.corners or ((-x, -y), (x, -y), (x, y), (-x, y)))


def test_links_reach_from_joint_to_joint_and_the_last_to_the_ball_of_its_tip(display):
    for shown in (display.shown[0], display.shown[-1]):
        for i in range(len(display.run.scenario.fingers)):
            for k, end in enumerate((f"finger_{i}/link_1", f"finger_{i}/tip")):
                entity = shown.entities[f"finger_{i}/link_{k}"]
                bar, axle = entity.cylinders
                pose = matrix(bar.pose.position, bar.pose.orientation)
                ends = placed(pose, [[0, 0, -0.5 * bar.size.z], [0, 0, 0.5 * bar.size.z]])
                start, stop = shown.place(entity, ends)
                joint, following = (shown.pose(frame)[:3, 3] for frame in (entity.frame_id, end))
                gap = k * 0.5 * shown.entities[f"contact_{i}"].spheres[0].size.x
                along = (following - joint) / np.linalg.norm(following - joint)
                np.testing.assert_allclose(start, joint, atol=1e-14)
                np.testing.assert_allclose(stop + gap * along, following, atol=1e-14)
                assert 0.0 < bar.top_scale < bar.bottom_scale == 1.0
                assert axle.size.z > bar.size.x and axle.pose.position.x == 0.0


def test_fingertip_and_arrow_have_the_colour_of_the_phase_and_the_trail_that_of_its_direction(
    display,
):
    for row, i, _, entity in display.contacts():
        phase, slip = display.samples.phase[row, i], display.samples.slip[row, i]
        assert rgb(entity.spheres[0].color) == PHASES[phase]
        assert rgb(entity.arrows[0].color) == PHASES[phase]
        assert rgb(entity.lines[1].color) == PHASES[np.sign(slip)]


def test_arrows_are_the_forces_on_the_object_at_one_scale(display):
    lengths = []
    for row, i, shown, entity in display.contacts():
        (arrow,) = entity.arrows
        pose = matrix(arrow.pose.position, arrow.pose.orientation)
        length = arrow.shaft_length + arrow.head_length
        tail, head = shown.place(entity, placed(pose, [[0, 0, 0], [length, 0, 0]]))
        frame = shown.pose(f"contact_{i}")
        tangential = display.samples.tangential_force[row, i]
        force = frame[:2, :2] @ (tangential, display.samples.normal_force[row, i])
        np.testing.assert_allclose(tail[:2], frame[:2, 3], atol=1e-14)
        np.testing.assert_allclose((head - tail)[:2] / length, force / np.hypot(*force), atol=1e-12)
        lengths.append(length / np.hypot(*force))
    np.testing.assert_allclose(lengths, lengths[0], rtol=1e-12)
    body = display.run.scenario.object
    weight = body.mass * display.run.scenario.simulation.gravity
    ends = corners_of(body)
    sides = np.roll(ends, -1, axis=0) - ends
    outward = np.stack([sides[:, 1], -sides[:, 0]], axis=1) / np.hypot(*sides.T)[:, None]
    nearest = (ends * outward).sum(axis=1).min()
    assert lengths[0] * 2.0 * weight == pytest.approx(nearest)


def test_a_cone_follows_a_timed_change_of_friction():
    scenario = with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.2})
    change = Change(time=0.1, parameter="fingers.1.friction", value=0.4)
    run = simulate(replace(scenario, changes=(change,)))
    shown = shown_rows(run)
    _, layout = display_layouts(run.scenario, 1)
    records = np.empty(len(shown), layout.record_type)
    layout.pack(records, states_of(shown), 0)
    frictions = []
    for payload in records["payload"]:
        entities = {e.id: e for e in SceneUpdate.FromString(payload.tobytes()).entities}
        edge = entities["contact_1"].lines[0].points[1]
        frictions.append(edge.x / edge.y)
    np.testing.assert_allclose(frictions, np.where(shown.times <= 0.1, 0.25, 0.4), rtol=1e-12)


def rgb(colour):
    """A decoded colour in the palette's numbers; every colour is opaque."""
    assert colour.a == 1.0
    return tuple(round(255.0 * channel) for channel in (colour.r, colour.g, colour.b))
