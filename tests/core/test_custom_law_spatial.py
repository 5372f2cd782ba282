"""Custom laws for spatial hands: what they see."""

from typing import ClassVar

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from slipgrasp import (
    LawParameter,
    load_scenario,
    register_law,
    simulate,
    with_law,
    with_values,
)
from slipgrasp.core.scenario.custom_laws import forget
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.types import Outcome

pytestmark = pytest.mark.usefixtures("known_laws")

GRIP = 30.0
BASE = with_values(
    with_law(load_scenario("spatial-composite"), "pd-gravity"),
    {
        "controller.grip_force": GRIP,
        "simulation.duration": 0.3,
        "trajectory.kind": "set-points",
        "trajectory.set_points.0.time": 0.0,
        "trajectory.set_points.0.duration": 0.25,
        "trajectory.set_points.0.pose": (0.01, 0.005, 0.37, 0.02, -0.05, 0.1),
    },
)


def of_law(law, scenario=BASE, **values):
    register_law(law)
    return with_values(scenario, {"controller.kind": law.name, **values})


def cross_matrices(vectors):
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)


def link_torques(seen):
    """What carries the links: from the heights of their centres of mass."""
    yaw = seen.joint_position[:, 0]
    radial = np.stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)], axis=1)
    ahead = np.einsum("nlc,nc->nl", seen.link_direction, radial)
    masses, centres, lengths = (
        seen.model.link_masses,
        seen.model.link_centres,
        seen.model.link_lengths,
    )
    outer = masses[:, 1] * centres[:, 1] * ahead[:, 1]
    inner = (masses[:, 0] * centres[:, 0] + masses[:, 1] * lengths[:, 0]) * ahead[:, 0]
    return seen.model.gravity * np.stack([np.zeros_like(outer), inner + outer, outer], axis=1)


class Pd:
    """The law pd-gravity, from what a law is shown alone."""

    name = "pd"

    def command(self, seen, memory, out):
        n, model = len(seen.slip), seen.model
        pull = seen.position_gain * seen.error + seen.velocity_gain * seen.error_rate
        R = Rotation.from_quat(seen.pose[[4, 5, 6, 3]]).as_matrix()
        inertia = R @ np.diag(model.object_inertias) @ R.T
        weight = [0.0, 0.0, model.object_mass * model.gravity]
        wrench = np.append(model.object_mass * pull[:3] + weight, inertia @ pull[3:])
        arms = np.concatenate(list(cross_matrices(seen.contact_arm)), axis=1)
        W = np.vstack([np.tile(np.eye(3), n), arms])
        squeeze = (seen.grip_force * seen.contact_normal).ravel()
        forces = (squeeze + np.linalg.pinv(W) @ (wrench - W @ squeeze)).reshape(n, 3)
        out.torque[:] = np.einsum("nij,ni->nj", seen.jacobian, forces) + link_torques(seen)


class Reflex(Pd):
    """The law grip-reflex: it presses harder while it sees a slip."""

    name = "reflex"
    parameters: ClassVar = {
        "rate": LawParameter(value=50.0, unit="N/s", minimum=0.0, maximum=1e3, text="Of the grip.")
    }
    memory: ClassVar = {"added": 1}

    def command(self, seen, memory, out):
        super().command(seen._replace(grip_force=seen.grip_force + memory.added[0]), memory, out)
        if (seen.believed_phase != 0).any():
            memory.added[0] += seen.parameters.rate * seen.period


class Look(Pd):
    """Grips the object, and checks what it is shown against closed forms."""

    name = "look"

    def command(self, seen, memory, out):
        super().command(seen, memory, out)
        n, near = len(seen.slip), {"rtol": 0.0, "atol": 1e-12}
        moving = np.einsum("nij,nj->ni", seen.jacobian, seen.joint_velocity)
        sliding = np.einsum("nk,nkc->nc", seen.slip_velocity, seen.contact_tangents)
        rigid = seen.velocity[:3] + np.cross(seen.velocity[3:], seen.contact_arm)
        np.testing.assert_allclose(moving, rigid + sliding, **near)
        inverse = np.einsum("nij,njk->nik", seen.jacobian_inverse, seen.jacobian)
        np.testing.assert_allclose(inverse, np.broadcast_to(np.eye(3), (n, 3, 3)), **near)
        np.testing.assert_allclose(seen.error[:3], (seen.desired_pose - seen.pose)[:3], **near)
        actual, desired = (
            Rotation.from_quat(pose[[4, 5, 6, 3]]) for pose in (seen.pose, seen.desired_pose)
        )
        np.testing.assert_allclose(-seen.error[3:], (actual * desired.inv()).as_rotvec(), **near)
        faces = np.concatenate((seen.contact_tangents, seen.contact_normal[:, None]), axis=1)
        unit = np.einsum("nac,nbc->nab", faces, faces)
        np.testing.assert_allclose(unit, np.broadcast_to(np.eye(3), (n, 3, 3)), **near)
        lengths = np.linalg.norm(seen.link_direction, axis=2)
        np.testing.assert_allclose(lengths, 1.0, **near)
        slips = np.linalg.norm(seen.slip_direction, axis=1)
        np.testing.assert_allclose(slips, (seen.believed_phase != 0).astype(float), **near)


class Feel(Pd):
    """Grips the object, and tells the forces at its second contact."""

    name = "feel"
    diagnostics: ClassVar = {
        axis: ("N", "Contact force.") for axis in ("first", "second", "normal")
    }

    def command(self, seen, memory, out):
        super().command(seen, memory, out)
        out.first[0], out.second[0], out.normal[0] = seen.contact_force[1]


@pytest.mark.parametrize(("law", "grip"), [(Pd, GRIP), (Reflex, 8.0)])
@pytest.mark.parametrize("friction", ["cone", "pyramid"])
def test_grip_laws_from_what_is_shown_do_what_the_built_in_laws_do(law, grip, friction):
    values = {"controller.grip_force": grip, "simulation.friction": friction}
    built_in = {Pd: {}, Reflex: {"controller.kind": "grip-reflex", "controller.grip_rate": 50.0}}
    own = simulate(of_law(law, **values))
    built_in = simulate(with_values(BASE, {**values, **built_in[law]}))
    assert (own.trace.phase != 0).any() == (law is Reflex)
    assert own.outcome is built_in.outcome is Outcome.COMPLETED
    np.testing.assert_allclose(own.ticks.commands, built_in.ticks.commands, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(
        own.trace.object_pose[-1], built_in.trace.object_pose[-1], rtol=0.0, atol=1e-10
    )


@pytest.mark.parametrize("friction", ["cone", "pyramid"])
def test_what_is_shown_agrees_with_itself_in_stick_and_slip(friction):
    slippery = {f"fingers.{i}.friction": 0.05 for i in range(3)}
    result = simulate(of_law(Look, **slippery, **{"simulation.friction": friction}))
    assert result.reason is None or result.reason.code != "law_failed", result.reason
    assert (result.trace.phase != 0).any() and len(result.ticks) > 50


def felt(**values):
    """Forces that were felt at every tick, ``(ticks, 3)``, and the trace."""
    slippery = {f"fingers.{i}.friction": 0.05 for i in range(3)}
    result = simulate(of_law(Feel, **slippery, **values))
    columns = {c.name: c.values for c in columns_of(result.trace)}
    told = [columns[f"law_{axis}"] for axis in ("first", "second", "normal")]
    forget("feel")
    return result.ticks.diagnostics, np.transpose(told), result.trace


def test_contact_forces_are_felt_as_they_are_until_the_tick():
    ticks, told, trace = felt(**{"simulation.output_rate": 10_000.0})
    assert not ticks[0].any() and (trace.phase[:, 1] != 0).any()
    assert told[-1].tolist() == ticks[-1].tolist()
    true = np.column_stack([-trace.tangential_force[:, 2:4], trace.normal_force[:, 1]])
    compared = 0
    for tick in range(5, 300, 7):
        row = np.searchsorted(trace.times, tick * 1e-3 - 1e-9)
        earlier, before = true[row - 2], true[row - 1]
        step = trace.times[row - 1] - trace.times[row - 2]
        if abs(step - 1e-4) < 1e-9:
            # The force a moment later, from two rows before the tick.
            np.testing.assert_allclose(ticks[tick], 2.0 * before - earlier, atol=2e-4)
            compared += 1
    assert compared > 20


def test_felt_forces_have_their_bias_filter_and_noise():
    true, _, _ = felt()
    biased, _, _ = felt(**{"sensing.force_bias": [2.0, -3.0]})
    np.testing.assert_allclose(
        (biased - true)[1:], [[2.0, 2.0, -3.0]] * (len(true) - 1), atol=1e-12
    )
    filtered, _, _ = felt(**{"sensing.force_filter_time": 0.004})
    expected = np.zeros(3)
    for tick in range(1, len(true)):
        expected = expected + max(0.2, 1.0 / tick) * (true[tick] - expected)
        np.testing.assert_allclose(filtered[tick], expected, atol=1e-9)
    noisy, _, _ = felt(**{"sensing.force_noise": 0.5})
    errors = (noisy - true)[1:]
    assert np.abs(errors.mean(axis=0)).max() < 4.0 * 0.5 / np.sqrt(len(errors))
    np.testing.assert_allclose(errors.std(axis=0), 0.5, rtol=0.15)
    assert np.abs(np.corrcoef(errors.T) - np.eye(3)).max() < 0.25
