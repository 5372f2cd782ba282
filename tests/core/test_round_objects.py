"""Cylinders and spheres as objects of spatial hands: contact frames that turn as tips slip."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag
from scipy.spatial.transform import Rotation

from slipgrasp import register_law, simulate, with_law
from slipgrasp.core.run.claims import contradictions_of
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from slipgrasp.core.trace.types import Outcome
from tests.core.drawn_hands_in_space import draw_hand_in_space
from tests.core.drawn_round_objects import with_round_object
from tests.references.implicit_contacts import Body, Tip, solve_motion
from tests.references.spatial_hands import (
    at_rest_where_stuck,
    cone_phases,
    random_state,
)
from tests.references.spatial_plant import cross_matrix, rotation_matrix
from tests.references.spatial_scenarios import random_spatial_scenario, world_of
from tests.spatial_evaluation import SpatialEvaluation

pytestmark = pytest.mark.slow

SHAPES = ("cylinder", "sphere")
HANDS = [(n, seed) for n in (2, 4) for seed in range(2)]
SURFACES = {"cylinder": np.diag([1.0, 1.0, 0.0]), "sphere": np.eye(3)}
AZIMUTHS = {"side-0": -0.5 * np.pi, "side-1": 0.0, "side-2": 0.5 * np.pi, "side-3": np.pi}


def sample(shape, n, seed, **values):
    rng = np.random.default_rng([SHAPES.index(shape), n, seed])
    values |= {"object.shape": shape, "object.radius": rng.uniform(0.05, 0.12)}
    return rng, with_values(random_spatial_scenario(rng, n, "masses"), values), random_state(rng, n)


def placed(scenario, state, i):
    """Contact point, t_x, t_y and n in the object's frame, by rotations of what is there first."""
    body, finger = scenario.object, scenario.fingers[i]
    azimuth, radius = AZIMUTHS[finger.face], body.radius
    x, y = finger.contact_offset
    if body.shape == "cylinder":
        azimuth += (y + state.slip[i, 1]) / radius
        height = x + state.slip[i, 0]
        outward = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        up = np.array([0.0, 0.0, 1.0])
        return radius * outward + height * up, np.array([up, np.cross(up, outward), -outward])
    outward = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    frame = np.array([up, np.cross(up, outward), -outward])
    size = np.linalg.norm(state.slip[i])
    arc = state.slip[i] * 2.0 * radius * np.arctan(0.5 * size / radius) / size
    for way in (np.array([x, y]), arc):
        axis = np.cross(way @ frame[:2], frame[2]) / radius
        frame = frame @ Rotation.from_rotvec(axis).as_matrix().T
    return -radius * frame[2], frame


def implicit_motion(scenario, state, phase, torques):
    """The same motion from the surface's equation, and arms and frames there, by the references."""
    world = world_of(with_values(scenario, {"object.shape": "prism"}))
    hand, truth, n = world.hand, world.truth, len(scenario.fingers)
    R, omega = rotation_matrix(state.quaternion), state.velocity[3:]
    contacts = [placed(scenario, state, i) for i in range(n)]
    arms = np.array([R @ point for point, _ in contacts])
    frames = np.array([frame @ R.T for _, frame in contacts])
    sliding = np.einsum("nk,nkc->nc", state.slip_velocity, frames[:, :2])
    velocities = state.velocity[:3] + np.cross(omega, arms) + sliding
    q = hand.fingers.joint_positions(state.position + arms)
    links, lengths = hand.fingers.links(q), hand.fingers.lengths
    J = hand.fingers.along(lengths, links.jacobians)
    qd = np.linalg.solve(J, velocities[:, :, None])[:, :, 0]
    drift = hand.fingers.along(lengths, links.biases(qd))
    own = hand.fingers.dynamics_per_mass(links, qd, hand.gravity)
    masses = truth.link_masses.T
    inertia = (masses[:, :, None, None] * own[0]).sum(axis=0)
    bias = (masses[:, :, None] * own[1]).sum(axis=0)
    tips = [
        Tip(
            inertia[i],
            bias[i],
            J[i],
            drift[i],
            arms[i],
            velocities[i],
            torques[i],
            truth.friction[i],
            bool(phase.slipping[i]),
        )
        for i in range(n)
    ]
    turning = R @ np.diag(truth.object_inertias) @ R.T
    mass, weight = truth.object_mass * np.eye(3), truth.object_mass * hand.gravity
    M_o = block_diag(mass, turning)
    h_o = np.concatenate(([0.0, 0.0, weight], np.cross(omega, turning @ omega)))
    body = Body(M_o, h_o, R, cross_matrix(omega), state.velocity[:3], np.zeros(6))
    return solve_motion(tips, body, SURFACES[scenario.object.shape]), arms, frames, qd


def evaluation_of(scenario, state, phase):
    given = np.array([each.initial for each in scenario.estimates])
    return SpatialEvaluation(scenario, state, phase, given)


def assert_close(actual, wanted, tolerance=1e-10):
    scale = 1.0 + np.abs(wanted).max()
    np.testing.assert_allclose(actual, wanted, rtol=0.0, atol=tolerance * scale)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize(("n", "seed"), HANDS)
def test_the_motion_is_that_of_points_on_the_equation_of_the_surface(shape, n, seed):
    rng, scenario, state = sample(shape, n, seed)
    for phase in cone_phases(state):
        torques = rng.uniform(-20.0, 20.0, (n, 3))
        at = at_rest_where_stuck(state, phase)
        wanted, arms, frames, qd = implicit_motion(scenario, at, phase, torques)
        motion = evaluation_of(scenario, at, phase).plant(torques)
        assert_close(motion.arms, arms, 1e-13)
        assert_close(motion.joint_rates, qd)
        assert_close(motion.acceleration[:6], wanted.acceleration)
        forces = np.einsum("nk,nkc->nc", motion.forces * [-1.0, -1.0, 1.0], frames)
        assert_close(forces, wanted.forces)
        slips = motion.acceleration[6:].reshape(n, 2)
        assert_close((slips * phase.directions).sum(axis=1), wanted.speed_rates)


RADIUS, PRESS, FRICTION, INERTIA = 0.1, 10.0, 0.3, 0.005
BRAKING = 2.0 * FRICTION * PRESS * RADIUS
"""Moment by which two tips brake an object that turns between them [N m]."""


class Pressing:
    """Constant forces of tips on slides."""

    name = "pressing-in-space"

    def command(self, seen, memory, out):
        out.torque[:] = [[PRESS, FRICTION * PRESS, 0.0], [-PRESS, -FRICTION * PRESS, 0.0]]


def turning(shape, drive, duration):
    """An object between two tips on slides, turned about z by a moment, without gravity."""
    register_law(Pressing)
    fingers = [
        {"kind": "slides", "base": [0.0, 0.0, 0.0], "face": face, "friction": FRICTION}
        for face in ("side-3", "side-1")
    ]
    body = {"shape": shape, "radius": RADIUS, "mass": 1.0, "height": 0.1}
    pulse = {"time": 0.0, "duration": drive, "force": [0.0] * 3}
    return scenario_from_mapping(
        {
            "object": {**body, "inertias": [INERTIA] * 3},
            "fingers": fingers,
            "trajectory": {"start": [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]},
            "controller": {"kind": "pressing-in-space", "control_period": 0.001},
            "pulses": [{**pulse, "moment": [0.0, 0.0, 2.0 * BRAKING]}],
            "simulation": {"gravity": 0.0, "duration": duration, "output_rate": 1000.0},
        }
    )


@pytest.mark.usefixtures("known_laws")
@pytest.mark.parametrize(("shape", "drive"), [("cylinder", 0.3), ("sphere", 0.13)])
def test_an_object_that_turns_between_two_tips_stops_when_and_where_it_must(shape, drive):
    """The tips stay where they are; around a cylinder each slips by more than a whole turn."""
    rate = BRAKING / INERTIA
    stop = 2.0 * drive
    result = simulate(turning(shape, drive, stop + 0.002))
    trace = result.trace
    moving = trace.times < stop
    t = trace.times[moving]
    later = np.maximum(t - drive, 0.0)
    angle = 0.5 * rate * np.minimum(t, drive) ** 2 + later * rate * (drive - 0.5 * later)
    assert angle[-1] > (2.0 * np.pi if shape == "cylinder" else 2.0)
    way = angle if shape == "cylinder" else 2.0 * np.tan(0.5 * angle)
    slips = trace.slip[moving]
    np.testing.assert_allclose(slips[:, 1::2], -RADIUS * way[:, None] * [1, 1], atol=1e-7)
    np.testing.assert_allclose(slips[:, ::2], 0.0, atol=1e-12)
    np.testing.assert_allclose(trace.slip_path[moving], RADIUS * angle[:, None] * [1, 1], atol=1e-8)
    np.testing.assert_allclose(trace.normal_force[moving], PRESS, atol=1e-7)
    ends = [change.time for change in result.phase_changes if change.to_phase == 0]
    assert ends == pytest.approx([stop, stop], abs=1e-7)


BOX = load_scenario("spatial-box")
SLIPPERY = {
    "controller.grip_force": 11.0,
    "object.inertias": (0.01, 0.01, 0.01),
    "simulation.duration": 0.11,
}


def on_sphere(angle):
    """Slipping tips on a sphere whose own frame is turned about x by an angle; the hand is not."""
    c, s = np.cos(angle), np.sin(angle)
    values = {"object.shape": "sphere", **SLIPPERY}
    values["trajectory.start"] = (
        0.0,
        0.0,
        0.366,
        np.cos(0.5 * angle),
        np.sin(0.5 * angle),
        0.0,
        0.0,
    )
    for i, finger in enumerate(BOX.fingers):
        sign = 1.0 if finger.face == "side-1" else -1.0
        x, y = np.add(finger.contact_offset, (0.01, 0.02))
        values[f"fingers.{i}.contact_offset"] = (x * c - sign * y * s, sign * x * s + y * c)
    return simulate(with_values(with_law(BOX, "pd-gravity"), values))


def test_a_run_does_not_depend_on_how_coordinates_lie_on_a_sphere():
    straight, turned = on_sphere(0.0), on_sphere(0.7)
    one, other = straight.trace, turned.trace
    assert straight.metrics.slip_path[0] > 5e-3
    assert np.abs(one.slip - other.slip).max() > 1e-3
    assert len(one) == len(other)
    np.testing.assert_allclose(one.slip_path, other.slip_path, atol=1e-8)
    np.testing.assert_allclose(one.normal_force, other.normal_force, atol=1e-6)
    np.testing.assert_allclose(one.object_pose[:, :3], other.object_pose[:, :3], atol=1e-8)
    np.testing.assert_allclose(one.joint_position, other.joint_position, atol=1e-8)


@pytest.mark.parametrize("friction", ["cone", "pyramid"])
@pytest.mark.parametrize("shape", SHAPES)
def test_energy_is_kept_and_what_is_stated_of_slips_follows_from_the_poses(shape, friction):
    values = {"object.shape": shape, "simulation.friction": friction, **SLIPPERY}
    result = simulate(with_values(with_law(BOX, "pd-gravity"), values))
    assert result.outcome is Outcome.COMPLETED
    assert result.metrics.slip_path[0] > 5e-3
    assert np.abs(result.trace.energy_residual).max() < 1e-8
    assert contradictions_of(result) == ()
    moved = replace(result, trace=replace(result.trace, slip=1.001 * result.trace.slip))
    assert {each.what for each in contradictions_of(moved)} >= {"slip_0"}


@pytest.mark.parametrize("shape", SHAPES)
def test_energy_is_kept_where_soft_fingertips_turn_and_slip_on_a_curved_face(shape):
    values = {"object.shape": shape, "controller.distribution": "hold", **SLIPPERY}
    values |= {f"fingers.{i}.pad_radius": 0.015 for i in range(3)}
    values |= {"pulses.0.time": 0.02, "pulses.0.force": (0.0, 0.0, 0.0)}
    values |= {"pulses.0.moment": (0.3, 0.2, 0.2), "simulation.duration": 0.08}
    result = simulate(with_values(with_law(BOX, "pd-gravity"), values))
    assert result.outcome is Outcome.COMPLETED
    assert min(result.metrics.slip_path) > 1e-3
    assert max(result.metrics.spin_path) > 0.03
    assert np.abs(result.trace.energy_residual).max() < 1e-8
    assert contradictions_of(result) == ()


def test_a_cylinder_that_is_held_too_loosely_is_lost_over_its_end():
    values = {"object.shape": "cylinder", "object.radius": 0.04, "controller.grip_force": 2.0}
    result = simulate(with_values(load_scenario("gripper-lift"), values))
    assert result.outcome is Outcome.LEFT_FACE
    assert "over the end of the cylinder" in result.reason.message
    assert np.abs(result.trace.slip[-1]).max() == pytest.approx(0.05, abs=1e-9)


def test_a_fingertip_leaves_the_end_of_a_cylinder_over_its_rim():
    """Two tips press from above and below, off the axis, and the cylinder is pushed aside."""
    values = {f"fingers.{i}.face": face for i, face in enumerate(("top", "bottom"))}
    values |= {f"fingers.{i}.contact_offset": (0.01, 0.005) for i in range(2)}
    values |= {"object.shape": "cylinder", "object.radius": 0.04, "simulation.gravity": 0.0}
    values |= {"pulses.0.time": 0.1, "pulses.0.duration": 1.0, "pulses.0.force": (12.0, 3.0, 0.0)}
    result = simulate(with_values(load_scenario("gripper-lift"), values))
    assert result.outcome is Outcome.LEFT_FACE
    assert "over the rim of" in result.reason.message
    contact, scenario = result.reason.contact, result.scenario
    slip = result.trace.slip[-1, 2 * contact : 2 * contact + 2]
    place = slip + scenario.fingers[contact].contact_offset
    assert np.hypot(*place) == pytest.approx(0.04, abs=1e-9)
    assert contradictions_of(result) == ()


ENDS = {Outcome.COMPLETED, Outcome.SEPARATED, Outcome.LEFT_FACE}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("group", range(5))
def test_random_hands_keep_energy_on_round_objects_and_end_for_a_physical_reason(shape, group):
    for number in range(8):
        drawn = draw_hand_in_space(f"{shape} {group} {number}")
        result = simulate(with_round_object(drawn, shape, 0.1))
        assert result.outcome in ENDS, number
        trace = result.trace
        size = 1.0 + trace.dissipated_energy.max()
        assert np.abs(trace.energy_residual).max() < 1e-7 * size, number
        assert np.diff(trace.dissipated_energy, prepend=0.0).min() > -1e-9 * size, number
        assert contradictions_of(result) == (), number
