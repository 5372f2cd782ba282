"""The geometry of the scene against identities, for planar and spatial hands by one code."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.geometry import outline
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.scenario.spatial_geometry import friction_outline, spatial_joint_points
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.scene import parts, rotations, skeleton
from slipgrasp.scene.parts import entities_of
from slipgrasp.scene.primitives import Arrow, Ball, Lines, Rod, Role, Triangles
from slipgrasp.scene.sizes import sizes_of
from slipgrasp.scene.skeleton import contacts_of, frames_of, world_poses
from slipgrasp.scene.states import states_at, states_of
from tests.core.test_chains import with_split_joints
from tests.held_polygon import held_polygon
from tests.planar_joints import joint_points


@pytest.fixture(scope="module")
def runs():
    short = {"simulation.duration": 0.1}
    presets = ("paper-case-2", "spatial-prism", "spatial-pyramid")
    found = [simulate(with_values(load_scenario(name), short)) for name in presets]
    return [*found, simulate(held_polygon())]


def entity(scenario, name):
    return next(each for each in entities_of(scenario) if each.name == name)


def test_the_chain_of_joints_ends_where_the_fingertip_touches_the_object(runs):
    for run in runs:
        poses = world_poses(frames_of(run.scenario), states_of(run.trace))
        for i in range(len(run.scenario.fingers)):
            tip, contact = poses[skeleton.tip_frame(i)][0], poses[skeleton.contact_name(i)][0]
            assert_allclose(tip, contact, atol=1e-6)


def test_a_planar_hand_is_drawn_in_a_plane_that_stands_upright(runs):
    run = runs[0]
    poses = world_poses(frames_of(run.scenario), states_of(run.trace))
    angles = run.trace.joint_position.reshape(len(run.trace), -1, 2)
    for i, finger in enumerate(run.scenario.fingers):
        tip = poses[skeleton.tip_frame(i)][0]
        points = joint_points(finger, angles[:, i])
        assert_allclose(tip[:, [0, 2]], points[:, -1], atol=1e-14)
        assert_allclose(tip[:, 1], 0.0, atol=1e-14)
        assert_allclose(poses[skeleton.link_frame(i, 1)][0][:, [0, 2]], points[:, 1], atol=1e-14)


def test_a_spatial_hand_is_drawn_at_its_joints(runs):
    run = runs[1]
    poses = world_poses(frames_of(run.scenario), states_of(run.trace))
    angles = run.trace.joint_position.reshape(len(run.trace), -1, 3)
    for i, finger in enumerate(run.scenario.fingers):
        points = spatial_joint_points(finger, angles[:, i])
        names = (skeleton.base_frame(i), skeleton.link_frame(i, 1), skeleton.tip_frame(i))
        for k, name in enumerate(names):
            assert_allclose(poses[name][0], points[:, k], atol=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize("follows", [False, True])
def test_a_chain_is_drawn_at_its_joints_also_where_one_follows_another(follows):
    scenario = load_scenario("trifinger")
    if follows:
        scenario = with_split_joints(load_scenario("spatial-prism"))
    run = simulate(with_values(scenario, {"simulation.duration": 0.02}))
    poses = world_poses(frames_of(run.scenario), states_of(run.trace))
    angles = run.trace.joint_position.reshape(len(run.trace), -1, 3)
    for i, finger in enumerate(run.scenario.fingers):
        points = spatial_joint_points(finger, angles[:, i])
        links = [skeleton.link_frame(i, k) for k in range(len(finger.joints))]
        for k, name in enumerate((*links, skeleton.tip_frame(i))):
            assert_allclose(poses[name][0], points[:, k], atol=1e-13)
        assert_allclose(points[:, -1], poses[skeleton.contact_name(i)][0], atol=1e-6)
        assert all(entity(run.scenario, name).shapes for name in links)


def test_contacts_lie_on_the_faces_of_the_drawn_object_with_normals_into_it(runs):
    for run in runs:
        solid, _ = entity(run.scenario, skeleton.OBJECT).shapes
        assert isinstance(solid, Triangles)
        corners = solid.points[solid.indices]
        outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        for contact in contacts_of(run.scenario):
            assert_allclose(contact.axes.T @ contact.axes, np.eye(3), atol=1e-12)
            assert np.linalg.det(contact.axes) == pytest.approx(1.0)
            normal = contact.axes @ contact.inward
            faces = np.flatnonzero(outward @ normal < -1.0 + 1e-9)
            distance = (contact.anchor - corners[faces, 0]) @ normal
            assert len(faces) == 2
            assert_allclose(distance, 0.0, atol=1e-12)


def test_an_arrow_is_the_force_times_the_scale(runs):
    for run in runs:
        states, sizes = states_of(run.trace), sizes_of(run.scenario)
        force = np.hypot(run.trace.normal_force, run.trace.tangential_size)
        for i in range(len(run.scenario.fingers)):
            name = skeleton.contact_name(i)
            (arrow,) = (s for s in entity(run.scenario, name).shapes if isinstance(s, Arrow))
            vector = arrow.vector(states)
            length = np.linalg.norm(vector, axis=1)
            assert_allclose(length, sizes.per_newton * force[:, i], rtol=1e-12)
            inward = vector @ contacts_of(run.scenario)[i].inward
            assert_allclose(inward, sizes.per_newton * run.trace.normal_force[:, i], rtol=1e-12)


def test_the_force_of_a_sliding_contact_lies_on_the_edge_of_its_cone(runs):
    checked = 0
    for run in runs[:2]:
        states, rim = states_of(run.trace), friction_outline(run.scenario, 720)
        for i, contact in enumerate(contacts_of(run.scenario)):
            slips = states.phases[:, i] != ContactPhase.STICK
            edges = parts.cone_rim(contact, rim, states.friction[:, i, None, None])[slips]
            force = parts.force_in(contact, i, states)[slips]
            edges /= np.linalg.norm(edges, axis=2, keepdims=True)
            force /= np.linalg.norm(force, axis=1, keepdims=True)
            nearest = np.einsum("nki,ni->nk", edges, force).max(axis=1)
            assert_allclose(nearest, 1.0, atol=1e-5)
            checked += len(force)
    assert checked > 50


def test_trails_begin_at_the_first_touch_which_moves_with_the_object(runs):
    for run in runs:
        states = states_of(run.trace)
        poses = world_poses(frames_of(run.scenario), states)
        position, turn = poses[skeleton.OBJECT]
        for i, contact in enumerate(contacts_of(run.scenario)):
            name = skeleton.contact_name(i)
            trail = [s for s in entity(run.scenario, name).shapes if isinstance(s, Lines)][-1]
            assert callable(trail.points)
            front = np.array([0.0, 0.0, sizes_of(run.scenario).front])
            first = trail.points(states)[:, 0] - front
            origin, axes = poses[name]
            touched = origin + np.einsum("nij,nj->ni", axes, first)
            assert_allclose(touched, position + turn @ contact.anchor, atol=1e-12)


def test_fingertips_touch_their_faces_from_outside_and_links_reach_them(runs):
    for run in runs:
        sizes = sizes_of(run.scenario)
        for i, finger in enumerate(run.scenario.fingers):
            ball = entity(run.scenario, skeleton.contact_name(i)).shapes[0]
            assert isinstance(ball, Ball)
            inward = contacts_of(run.scenario)[i].inward
            assert_allclose(ball.centre, -sizes.tip_radius * inward)
            for k, length in enumerate(finger.link_lengths):
                link = entity(run.scenario, skeleton.link_frame(i, k)).shapes[0]
                assert isinstance(link, Rod)
                gap = sizes.tip_radius if k == len(finger.link_lengths) - 1 else 0.0
                assert_allclose(link.end, [length - gap, 0.0, 0.0])
                assert 0.0 < link.radii[1] < link.radii[0]


def test_desired_edges_are_those_of_the_object(runs):
    for run in runs:
        _, edges = entity(run.scenario, skeleton.OBJECT).shapes
        (wanted,) = entity(run.scenario, skeleton.DESIRED).shapes
        assert isinstance(edges, Lines) and isinstance(wanted, Lines)
        assert (edges.paint, wanted.paint) == (Role.OBJECT_EDGE, Role.DESIRED)
        assert_allclose(wanted.points[:, :2], edges.points[:, :2])
        assert len(wanted.indices) == 3 * len(outline(run.scenario.object))


def test_states_between_rows_lie_on_straight_lines_and_phases_do_not(runs):
    for run in runs:
        rows = states_of(run.trace)
        unique = np.flatnonzero(np.diff(run.trace.times, append=np.inf) > 0.0)
        same = states_at(run.trace, run.trace.times[unique])
        for name, values in rows._asdict().items():
            assert_allclose(getattr(same, name), values[unique], atol=1e-12, err_msg=name)
        a, b = unique[1], unique[1] + 1
        middle = states_at(run.trace, run.trace.times[[a, b]].mean(keepdims=True))
        assert_allclose(middle.slip[0], 0.5 * (rows.slip[a] + rows.slip[b]), atol=1e-12)
        np.testing.assert_array_equal(middle.phases[0], rows.phases[a])


def test_a_desired_attitude_is_the_error_followed_from_the_actual_one(runs):
    run = runs[1]
    states = states_of(run.trace)
    actual = Rotation.from_quat(run.trace.object_pose[:, 3:], scalar_first=True)
    wanted = Rotation.from_rotvec(run.trace.tracking_error[:, 3:]) * actual
    drawn = rotations.matrices(states.desired_pose[:, 3:])
    assert_allclose(drawn, wanted.as_matrix(), atol=1e-12)


def test_rotations_are_those_of_scipy():
    rng = np.random.default_rng(3)
    first, second = (Rotation.random(20, random_state=rng) for _ in range(2))
    a, b = (each.as_quat(scalar_first=True) for each in (first, second))
    product = rotations.matrices(rotations.product(a, b))
    assert_allclose(product, (first * second).as_matrix(), atol=1e-12)
    turned = [rotations.of_matrix(matrix) for matrix in first.as_matrix()]
    assert_allclose(rotations.matrices(np.array(turned)), first.as_matrix(), atol=1e-12)
    about = rotations.about(np.array([0.0, -1.0, 0.0]), np.array([0.3, -2.0]))
    expected = Rotation.from_rotvec([[0.0, -0.3, 0.0], [0.0, 2.0, 0.0]])
    assert_allclose(rotations.matrices(about), expected.as_matrix(), atol=1e-12)


def test_the_x_axis_turns_to_any_direction_even_back_and_stays_where_there_is_none():
    vectors = np.array([[3.0, -4.0, 1.0], [-2.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1e300]])
    turns = rotations.matrices(rotations.from_x_to(vectors))
    unit = [vectors[0] / np.sqrt(26.0), [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    assert_allclose(turns[:, :, 0], unit, atol=1e-12)


def test_sizes_grow_with_the_hand(runs):
    for run in runs[:2]:
        body = run.scenario.object
        names = ("half_width", "face_half_length", "half_depth", "height")
        grown = {name: 2.0 * getattr(body, name) for name in names if hasattr(body, name)}
        corners = tuple((2.0 * x, 2.0 * y) for x, y in body.corners)
        larger = replace(run.scenario, object=replace(body, **grown, corners=corners))
        before, after = sizes_of(run.scenario), sizes_of(larger)
        assert after.mark == pytest.approx(2.0 * before.mark)
        assert after.tip_radius == pytest.approx(2.0 * before.tip_radius)


@pytest.fixture(scope="module")
def pivot():
    values = {"simulation.duration": 1.3}
    return simulate(with_values(load_scenario("parallel-gripper"), values))


def test_the_hand_of_a_pad_on_jaws_that_do_not_turn_keeps_its_direction_in_the_world(pivot):
    states = states_of(pivot.trace)
    poses = world_poses(frames_of(pivot.scenario), states)
    assert np.abs(states.spin).max() > 0.7
    for name in map(skeleton.contact_name, range(2)):
        shapes = entity(pivot.scenario, name).shapes
        (disc,) = (each for each in shapes if isinstance(each, Rod))
        (hand,) = (each for each in shapes if isinstance(each, Lines) and each.paint is Role.JOINT)
        assert disc.radii == (0.015, 0.015)
        middle, end = np.moveaxis(hand.points(states), 1, 0)
        assert_allclose(middle, 0.0)
        assert_allclose(np.linalg.norm(end, axis=1), parts.PAD_POINTER * 0.015)
        turned = np.einsum("nij,nj->ni", poses[name][1], end)
        assert_allclose(turned, turned[:1].repeat(len(turned), axis=0), atol=1e-5)


def test_hard_fingertips_have_no_pads(runs):
    for run in runs:
        states = states_of(run.trace)
        assert all(contact.pad is None for contact in contacts_of(run.scenario))
        assert states.spin.shape == states.phases.shape and not states.spin.any()
