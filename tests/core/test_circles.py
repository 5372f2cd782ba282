"""A circle as the object of planar hands: contacts whose frame turns as the tip slips."""

from typing import ClassVar

import numpy as np
import pytest

from slipgrasp import LawParameter, register_law, simulate
from slipgrasp.core.scenario import ObjectParameters
from slipgrasp.core.scenario.geometry import contact_frame, inner_radius, outline, smallest_extent
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from tests.core.drawn_round_objects import with_round_object
from tests.core.drawn_scenarios import KINDS, draw_scenario
from tests.each_case import each_case
from tests.phases import PHASES
from tests.references.closed_loop import ClosedLoop
from tests.references.hand import TURN
from tests.references.hands import random_estimates, random_scenario, random_state
from tests.references.implicit_contacts import Body, Tip, solve_motion
from tests.references.sliding_polygon import Slide
from tests.state_evaluation import evaluate_state

pytestmark = pytest.mark.slow

BASE = load_scenario("composite-case-2")
CIRCLE = with_values(BASE, {"object.shape": "circle"})
ANGLES = {"left": np.pi, "right": 0.0, "bottom": -0.5 * np.pi, "top": 0.5 * np.pi}
FEW = [phase for phase in PHASES if len(phase) < 4]

each_phase = each_case("phase", FEW)


def unit(angle):
    return np.array([np.cos(angle), np.sin(angle)])


def points_of(scenario, slips):
    """Angles at which tips are on the circle: slip goes round it clockwise."""
    radius = scenario.object.radius
    ways = slips + np.array([finger.contact_offset for finger in scenario.fingers])
    return np.array([ANGLES[f.face] for f in scenario.fingers]) - ways / radius


def sample(phase, unknown="masses"):
    """A random hand of a circle in a random state that fits the phase."""
    rng = np.random.default_rng([7, *(gamma + 1 for gamma in phase)])
    values = {"object.shape": "circle", "object.radius": rng.uniform(0.05, 0.2)}
    n = len(phase)
    values |= {f"fingers.{i}.contact_offset": rng.uniform(-0.02, 0.02) for i in range(n)}
    scenario = with_values(random_scenario(rng, n, unknown), values)
    return rng, scenario, random_state(rng, scenario, phase)


def evaluated(scenario, state, phase, torques, estimates=None):
    given = [each.initial for each in scenario.estimates] if estimates is None else estimates
    return evaluate_state(scenario, 0.4, *state, phase, given, torque=torques)


def implicit_motion(scenario, state, phase, torques):
    """The same motion from the circle's equation, and joints there, by the references."""
    loop, radius = ClosedLoop.from_scenario(on_straight_faces(scenario)), scenario.object.radius
    c, s = np.cos(state.pose[2]), np.sin(state.pose[2])
    rotation, omega = np.array([[c, -s], [s, c]]), state.velocity[2]
    tips, joints = [], []
    for i, (finger, angle) in enumerate(
        zip(loop.hand.fingers, points_of(scenario, state.slip), strict=True)
    ):
        arm = radius * rotation @ unit(angle)
        sliding = -state.slip_velocity[i] * rotation @ TURN @ unit(angle)
        velocity = state.velocity[:2] + omega * TURN @ arm + sliding
        q = finger.joint_positions(state.pose[:2] + arm)
        J = finger.jacobian(q)
        qd = np.linalg.solve(J, velocity)
        masses = loop.truth.link_masses[i]
        joints.append((q, qd))
        tips.append(
            Tip(
                finger.inertia_matrix(q, masses),
                finger.bias(q, qd, masses, loop.hand.gravity),
                J,
                finger.jacobian_rate_times_velocity(q, qd),
                arm,
                velocity,
                torques[2 * i : 2 * i + 2],
                loop.truth.friction[i],
                phase[i] != 0,
            )
        )
    inertia, bias = loop.hand.object_dynamics(loop.truth)
    body = Body(inertia, bias, rotation, omega * TURN, state.velocity[:2], np.zeros(3))
    return solve_motion(tips, body, np.eye(2)), joints


def on_straight_faces(scenario):
    """The same hand as the references know it: they are asked of fingers and masses alone."""
    return with_values(scenario, {"object.shape": "polygon"})


@each_phase
def test_the_motion_is_that_of_points_on_the_equation_of_the_circle(phase):
    rng, scenario, state = sample(phase)
    torques = rng.uniform(-20.0, 20.0, 2 * len(phase))
    kernel = evaluated(scenario, state, phase, torques)
    wanted, joints = implicit_motion(scenario, state, phase, torques)
    scale = 1.0 + np.abs(wanted.acceleration).max()
    turns = (kernel.joint_positions - [q for q, _ in joints]) / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-12)
    np.testing.assert_allclose(kernel.joint_velocities, [qd for _, qd in joints], atol=1e-12)
    np.testing.assert_allclose(
        kernel.acceleration[:3], wanted.acceleration, rtol=0.0, atol=1e-10 * scale
    )
    forces = np.einsum("nij,nj->ni", kernel.contact_frames, kernel.contact_forces)
    np.testing.assert_allclose(forces, wanted.forces, rtol=0.0, atol=1e-10 * scale)
    along = kernel.acceleration[3:] * np.array(phase)
    np.testing.assert_allclose(along, wanted.speed_rates, rtol=0.0, atol=1e-10 * scale)
    np.testing.assert_allclose(
        kernel.joint_accelerations, wanted.joint_accelerations, rtol=0.0, atol=1e-10 * scale
    )


@each_phase
@pytest.mark.parametrize("unknown", ["masses", "friction"])
def test_the_regressor_knows_the_curvature(phase, unknown):
    """M x'' + h = U phi + known: what is known does not depend on what is believed."""
    rng, scenario, state = sample(phase, unknown)
    torques = rng.uniform(-20.0, 20.0, 2 * len(phase))
    one, other = (
        evaluated(scenario, state, phase, torques, random_estimates(rng, scenario))
        for _ in range(2)
    )
    scale = 1.0 + np.abs(one.acceleration).max()
    np.testing.assert_allclose(one.known, other.known, rtol=0.0, atol=1e-11 * scale)


@pytest.mark.parametrize("face", ANGLES)
@pytest.mark.parametrize("offset", [-0.3, 0.0, 0.04])
def test_a_contact_on_a_circle_starts_at_the_end_of_its_arc(face, offset):
    body = ObjectParameters(shape="circle", radius=0.12)
    values = {"fingers.0.face": face, "fingers.0.contact_offset": offset}
    frame = contact_frame(body, with_values(BASE, {"fingers.0.face": face}).fingers[0])
    start = ANGLES[face]
    np.testing.assert_allclose(frame.anchor, 0.12 * unit(start), atol=1e-16)
    finger = with_values(CIRCLE, {**values, "fingers.0.kind": "slides"}).fingers[0]
    frame = contact_frame(body, finger)
    np.testing.assert_allclose(frame.anchor, 0.12 * unit(start - offset / 0.12), atol=1e-15)
    np.testing.assert_allclose(frame.normal, -np.array(frame.anchor) / 0.12, atol=1e-15)
    assert frame.normal == pytest.approx((frame.tangent[1], -frame.tangent[0]), abs=1e-15)
    assert (frame.slip_minimum, frame.slip_maximum) == (-np.inf, np.inf)


def test_sizes_of_a_circle_are_those_of_its_radius():
    body = ObjectParameters(shape="circle", radius=0.07)
    assert inner_radius(body) == 0.07
    assert smallest_extent(body) == 0.14
    np.testing.assert_allclose(np.hypot(*outline(body).T), 0.07)


RADIUS, PRESS, FRICTION = 0.1, 10.0, 0.3
BRAKING = 2.0 * FRICTION * PRESS * RADIUS
"""Moment by which two tips brake a circle that turns between them [N m]."""


class Pressing:
    """Constant forces of two tips on slides, so that they stay where they are as they slip."""

    parameters: ClassVar = {
        name: LawParameter(value=0.0, unit="N", minimum=-20.0, maximum=20.0, text="A force.")
        for name in ("left_x", "left_y", "right_x", "right_y")
    }

    def command(self, seen, memory, out):
        p = seen.parameters
        out.torque[:] = [[p.left_x, p.left_y], [p.right_x, p.right_y]]


def pressed(forces, moment, moment_time, duration, period=0.001):
    """A circle between two tips on slides, turned by a moment, without gravity."""
    register_law(Pressing)
    fingers = [
        {"kind": "slides", "base": [0.0, 0.0], "face": face, "friction": FRICTION, "mass": 0.1}
        for face in ("left", "right")
    ]
    names = list(Pressing.parameters)
    mapping = {
        "object": {"shape": "circle", "radius": RADIUS, "mass": 1.0, "inertia": 0.005},
        "fingers": fingers,
        "trajectory": {"start": [0.0, 0.0, 0.0]},
        "controller": {
            "kind": "pressing",
            "control_period": period,
            "parameters": dict(zip(names, np.ravel(forces).tolist(), strict=True)),
        },
        "pulses": [{"time": 0.0, "duration": moment_time, "force": [0.0, 0.0], "moment": moment}],
        "simulation": {"gravity": 0.0, "duration": duration, "output_rate": 1000.0},
    }
    return scenario_from_mapping(mapping)


@pytest.mark.usefixtures("known_laws")
def test_a_circle_that_turns_between_two_tips_stops_when_and_where_it_must():
    """The tips stay where they are: their forces are those of friction, and it turns below them.

    On the way it turns by more than a whole turn, and each tip slips once around it.
    """
    drive, moment = 0.3, 2.0 * BRAKING
    faster, slower = (moment - BRAKING) / 0.005, -BRAKING / 0.005
    stop = drive - faster * drive / slower
    forces = [[PRESS, FRICTION * PRESS], [-PRESS, -FRICTION * PRESS]]
    result = simulate(pressed(forces, moment, drive, stop + 0.002))
    trace = result.trace
    moving = trace.times < stop
    t = trace.times[moving]
    later = np.maximum(t - drive, 0.0)
    spin = faster * np.minimum(t, drive) + slower * later
    angle = 0.5 * faster * np.minimum(t, drive) ** 2 + later * (
        faster * drive + 0.5 * slower * later
    )
    assert angle[-1] > 2.0 * np.pi
    np.testing.assert_allclose(trace.object_pose[moving, 2], angle, atol=1e-8)
    np.testing.assert_allclose(trace.object_velocity[moving, 2], spin, atol=1e-7)
    np.testing.assert_allclose(trace.slip[moving], RADIUS * angle[:, None] * [1, 1], atol=1e-9)
    np.testing.assert_allclose(trace.normal_force[moving], PRESS, atol=1e-8)
    places = [[-RADIUS, 0.0, RADIUS, 0.0]]
    np.testing.assert_allclose(
        trace.joint_position[moving], np.repeat(places, len(t), 0), atol=1e-8
    )
    ends = [change.time for change in result.phase_changes if change.to_phase == 0]
    assert ends == pytest.approx([stop, stop], abs=1e-8)


UNEVEN = np.array([[10.0, 3.1], [-10.1, -2.95]])


@pytest.mark.usefixtures("known_laws")
def test_polygons_of_more_and_more_corners_come_to_the_motion_on_a_circle():
    trace = simulate(pressed(UNEVEN, 2.0 * BRAKING, 0.1, 0.1)).trace
    assert (trace.slip_velocity[2:] > 0.0).all()
    ends = np.concatenate([trace.object_pose[-1], trace.joint_position[-1]])
    load, start = np.array([0.0, 0.0, 2.0 * BRAKING]), np.zeros(7)
    start[[3, 5]] = -RADIUS, RADIUS
    errors = []
    for sides in (24, 48, 96):
        polygon = Slide(
            sides, RADIUS, 1.0, 0.005, 0.1, FRICTION, UNEVEN, load, np.array([-1.0, -1.0])
        )
        errors.append(np.abs(polygon.run(start, 0.1)[:7] - ends)[3:].max())
    assert errors[0] < 0.05
    assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2]


def test_composite_adaptation_learns_a_circle():
    result = simulate(with_values(CIRCLE, {"simulation.duration": 0.5}))
    assert result.metrics.last_slip_time < 0.02
    frictions = [finger.friction for finger in CIRCLE.fingers]
    np.testing.assert_allclose(result.trace.estimates[-1, :3], [*frictions, 1.0], rtol=1e-4)


@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_random_hands_keep_energy_on_circles(kind):
    checked = 0
    for number in range(8):
        drawn = draw_scenario(kind, f"circle {number}")
        if drawn.object.corners:
            continue
        trace = simulate(with_round_object(drawn, "circle", drawn.object.half_width)).trace[:-1]
        if len(trace) > 2:
            checked += 1
            size = 1.0 + trace.dissipated_energy.max() + trace.kinetic_energy.max()
            assert np.abs(trace.energy_residual).max() < 1e-6 * size, number
            assert np.diff(trace.dissipated_energy).min() > -1e-9 * size, number
    assert checked > 0
