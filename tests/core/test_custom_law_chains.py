"""Custom laws for fingers that are chains: what they see, and what becomes of their torques."""

from typing import ClassVar

import numba
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from slipgrasp import (
    Simulation,
    load_scenario,
    open_recording,
    register_law,
    simulate,
    verify,
    with_law,
    with_values,
    write_recording,
)
from slipgrasp.core.scenario.custom_laws import forget
from slipgrasp.core.scenario.loading import scenario_from_mapping
from slipgrasp.core.trace.types import Outcome
from tests.core.test_chains import SPLIT, as_chains, with_split_joints
from tests.core.test_custom_law_spatial import BASE, Pd, of_law

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("known_laws")]

TILT, TURN = 0.2, (0.1, 0.2, 0.0)  # of a slide, and of the base of its finger [rad]
ON_RAILS = [
    {"mass": 0.4, "centre": (0.1, 0.05, 0.0)},
    {"kind": "prismatic", "axis": (float(np.sin(TILT)), 0.0, float(np.cos(TILT))), "mass": 1.1},
    {"kind": "prismatic", "axis": (1.0, 0.0, 0.0), "mass": 0.7, "centre": (0.2, 0.0, 0.1)},
]


def trifinger():
    """A hand of a robot that moves its object by PD control, and mistakes three masses."""
    values = {"trajectory.kind": "set-points", "simulation.duration": 0.15}
    motion = {"time": 0.0, "duration": 0.12, "pose": (0.003, -0.002, 0.085, 0.02, -0.03, 0.05)}
    values |= {f"trajectory.set_points.0.{key}": value for key, value in motion.items()}
    for i in range(3):
        values[f"estimates.{i}.parameter"] = f"fingers.{i}.joints.1.mass"
        values[f"estimates.{i}.initial"] = 0.2
    scenario = with_values(load_scenario("trifinger"), values)
    return with_values(with_law(scenario, "pd-gravity"), {"controller.grip_force": 2.0})


def on_rails():
    """Fingers that turn about an axis, and slide along two others."""
    mapping = as_chains(BASE).to_mapping()
    x, y, z, w = Rotation.from_rotvec(TURN).as_quat().tolist()
    for finger in mapping["fingers"]:
        posture = (finger["posture"][0], 0.3, 0.8)
        finger |= {"joints": ON_RAILS, "tip": (0.3, 0.0, 0.0), "posture": posture}
        finger["attitude"] = (w, x, y, z)
    return scenario_from_mapping(mapping)


def mixed():
    """Two fingers with coupled joints, and one that is no chain."""
    mapping = with_split_joints(BASE).to_mapping()
    mapping["fingers"] = [*mapping["fingers"][:2], BASE.to_mapping()["fingers"][2]]
    return scenario_from_mapping(mapping)


def coupled():
    """Fingers of four joints, of which the last follows another one."""
    return with_split_joints(BASE)


class PdOfAny(Pd):
    """The law pd-gravity, for every kind of finger."""

    name = "pd-of-any"

    def command(self, seen, memory, out):
        # Without masses, the law that is tested with links does not carry them.
        none = seen.model._replace(link_masses=np.zeros_like(seen.model.link_masses))
        super().command(seen._replace(model=none), memory, out)
        out.torque[:] += seen.weight_torque


def lift_of(finger, masses, positions):
    """Potential energy of the links per gravity, from the positions of the three coordinates."""
    turn, point, total = Rotation.from_quat(np.roll(finger.attitude, -1)), np.zeros(3), 0.0
    coordinates = iter(positions)
    joined = {k: next(coordinates) for k, each in enumerate(finger.joints) if each.follows is None}
    for k, joint in enumerate(finger.joints):
        own = joined[k] if k in joined else joint.ratio * joined[joint.follows] + joint.offset
        along = own * np.array(joint.axis) / np.linalg.norm(joint.axis)
        point = point + turn.apply(joint.place)
        turn = turn * Rotation.from_quat(np.roll(joint.attitude, -1))
        if joint.kind == "prismatic":
            point = point + turn.apply(along)
        else:
            turn = turn * Rotation.from_rotvec(along)
        total += masses[k] * (point + turn.apply(joint.centre))[2]
    return total


def weight_of(finger, masses, positions, gravity):
    """Torques that carry the links, by differences of their potential energy."""
    steps = 1e-5 * np.eye(3)
    ahead, behind = (
        np.array([lift_of(finger, masses, positions + side * step) for step in steps])
        for side in (1.0, -1.0)
    )
    return gravity * (ahead - behind) / 2e-5


def looking_at(scenario):
    """A law that compares what it sees of chains with the scenario."""

    class Look(PdOfAny):
        name = "look"

        def command(self, seen, memory, out):
            super().command(seen, memory, out)
            if seen.tick % 5:
                return
            near = {"rtol": 0.0, "atol": 1e-12}
            moving = np.einsum("nij,nj->ni", seen.jacobian, seen.joint_velocity)
            sliding = np.einsum("nk,nkc->nc", seen.slip_velocity, seen.contact_tangents)
            rigid = seen.velocity[:3] + np.cross(seen.velocity[3:], seen.contact_arm)
            np.testing.assert_allclose(moving, rigid + sliding, **near)
            inverse = np.einsum("nij,njk->nik", seen.jacobian_inverse, seen.jacobian)
            np.testing.assert_allclose(inverse, [np.eye(3)] * len(moving), **near)
            believed = {e.parameter: e.initial for e in scenario.estimates}
            for i, finger in enumerate(scenario.fingers):
                if finger.kind != "chain":
                    continue
                masses = [
                    believed.get(f"fingers.{i}.joints.{k}.mass", joint.mass)
                    for k, joint in enumerate(finger.joints)
                ]
                weight = weight_of(finger, masses, seen.joint_position[i], seen.model.gravity)
                assert np.abs(weight).max() > 0.1
                np.testing.assert_allclose(seen.weight_torque[i], weight, atol=1e-8)
                assert not seen.model.link_masses[i].any()

    return Look


def hold(seen, memory, out):
    """A grip, lift, and the weight of the links, with damped joints."""
    lift = seen.model.object_mass * seen.model.gravity / len(seen.slip)
    for i in range(len(seen.slip)):
        for joint in range(3):
            torque = seen.weight_torque[i, joint] + seen.jacobian[i, 2, joint] * lift
            for axis in range(3):
                pressed = seen.grip_force * seen.contact_normal[i, axis]
                torque += pressed * seen.jacobian[i, axis, joint]
            out.torque[i, joint] = torque - 1e-3 * seen.joint_velocity[i, joint]
    out.most[0] = seen.model.joint_maximum[0, 1] - seen.joint_position[0, 1]


class Hold:
    """Holds the object, and tells how far a joint is from its limit."""

    name = "hold"
    diagnostics: ClassVar = {"most": ("rad", "Left of the range of the second joint.")}

    def command(self, seen, memory, out):
        hold(seen, memory, out)


class CompiledHold(Hold):
    """The same, compiled."""

    name = "compiled-hold"
    command = staticmethod(numba.njit(hold))


@pytest.mark.parametrize("hand", [trifinger, coupled, on_rails, mixed])
def test_pd_control_from_what_is_shown_does_what_the_built_in_law_does(hand):
    scenario = hand()
    own, built_in = simulate(of_law(PdOfAny, scenario)), simulate(scenario)
    assert own.outcome is built_in.outcome is Outcome.COMPLETED
    commands = built_in.ticks.commands
    assert np.ptp(commands, axis=0).min() > 1e-4 * np.abs(commands).max()
    np.testing.assert_allclose(own.ticks.commands, commands, rtol=0.0, atol=1e-8)
    for name in ("object_pose", "joint_position", "slip"):
        ours, theirs = (getattr(run.trace, name)[-1] for run in (own, built_in))
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("hand", [trifinger, coupled, on_rails, mixed])
def test_what_is_shown_of_chains_agrees_with_the_scenario(hand):
    result = simulate(of_law(looking_at(hand()), hand()))
    assert result.outcome is Outcome.COMPLETED, result.reason
    assert len(result.ticks) > 100


def first_seen(scenario):
    return next(Simulation(scenario).ticks()).seen


def test_limits_of_joints_are_shown_as_those_of_the_coordinates():
    own = {"fingers.1.joints.2.torque_limit": 7.0, "fingers.1.joints.0.minimum": -2.0}
    both = {"fingers.1.joints.2.maximum": 3.0, "fingers.1.joints.3.maximum": 2.5}
    turned = {"fingers.2.joints.3.ratio": -0.5, "fingers.2.joints.3.maximum": 2.5}
    seen = first_seen(with_values(coupled(), {**own, **both}))
    model, none = seen.model, [np.inf] * 3
    assert model.joint_torque_limit.tolist() == [none, [np.inf, np.inf, 7.0], none]
    assert model.joint_minimum.tolist() == [[-np.inf] * 3, [-2.0, -np.inf, -np.inf], [-np.inf] * 3]
    assert model.joint_maximum.tolist() == [none, [np.inf, np.inf, 2.5 - SPLIT], none]
    seen = first_seen(with_values(coupled(), turned))
    assert seen.model.joint_minimum[2, 2] == (2.5 - SPLIT) / -0.5
    limited = {"actuation.torque_limit": 9.0}
    seen = first_seen(with_values(mixed(), {**own, **limited}))
    assert (seen.model.joint_torque_limit == 9.0).all() and seen.model.torque_limit == 9.0
    assert np.isposinf(seen.model.joint_maximum[2]).all()


def test_python_and_compiled_code_give_the_same_bits_and_a_recording_verifies(tmp_path):
    noisy = {"controller.latency": 0.0015, "sensing.position_noise": 1e-6}
    python = simulate(of_law(Hold, trifinger(), **noisy))
    compiled = simulate(of_law(CompiledHold, trifinger(), **noisy))
    assert python.trace.to_rows().tobytes() == compiled.trace.to_rows().tobytes()
    left = 1.57 - python.trace.joint_position[0, 1]
    np.testing.assert_allclose(python.ticks.diagnostics[0], left, atol=1e-4)
    write_recording(python, tmp_path / "run.mcap")
    forget("hold")
    read = open_recording(tmp_path / "run.mcap")
    found = verify(read)
    assert (found.same, found.bit_for_bit, found.replayed) == (True, True, True)
    register_law(Hold)
    assert verify(read, with_law=True).same
