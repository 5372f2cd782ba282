"""One state of a hand taken apart, by the functions of the kernel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from slipgrasp.core.kernel.compilation.cache import INTERPRETED
from slipgrasp.core.kernel.compilation.compiler import call
from slipgrasp.core.kernel.compilation.records import Floats, Record, make_record
from slipgrasp.core.kernel.loop import motion
from slipgrasp.core.kernel.planar import dynamics, kinematics, law, reduced
from slipgrasp.core.kernel.planar.controllability import find_controllable
from slipgrasp.core.kernel.planar.flow import solve_plant, update_command, update_mechanics
from slipgrasp.core.kernel.planar.laws.interface import adapt
from slipgrasp.core.kernel.planar.packing import make_table, pack_model, whole_faces
from slipgrasp.core.kernel.planar.reduced import multiply_regressor
from slipgrasp.core.kernel.planar.state import STATE, parts_of
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE
from slipgrasp.core.run.checked_code import in_python
from slipgrasp.core.scenario import Scenario


def from_python(function: Any) -> Any:
    """A function that the kernel inlines, called from Python, which executes it.

    To compile it takes longer than a few thousand calls; that machine code computes the same is
    what tests of the interpreted kernel say.
    """
    if INTERPRETED:
        return function

    def called(*arguments: Any) -> Any:
        with in_python():
            return function.py_func(*arguments)

    return called


_apply_tip_forces = from_python(reduced.apply_tip_forces)
_assemble_bias = from_python(reduced.assemble_bias)
_desired_motion = from_python(motion.desired_motion)
_forces_to_torques = from_python(reduced.forces_to_torques)
_joint_position = from_python(kinematics.joint_position)
_lyapunov_value = from_python(law.lyapunov_value)
_multiply_regressor = from_python(multiply_regressor)
_stored_energy = from_python(dynamics.stored_energy)
_tip_acceleration = from_python(reduced.tip_acceleration)
_torques_to_forces = from_python(reduced.torques_to_forces)


class StateEvaluation(NamedTuple):
    """Kinematics, reduced equations (Eq. 18), law and solution at one state, SI units."""

    joint_positions: Floats  # (n, 2)
    joint_velocities: Floats  # (n, 2)
    finger_jacobians: Floats  # (n, 2, 2)
    grasp_matrix: Floats  # (3, 2n)
    contact_frames: Floats  # (n, 2, 2)
    reduced_inertia: Floats  # (3 + n, 3 + n)
    reduced_bias: Floats  # (3 + n,)
    reduced_input: Floats  # (3 + n, 2n)
    estimated_reduced_inertia: Floats  # (3 + n, 3 + n)
    estimated_reduced_bias: Floats  # (3 + n,)
    regressor: Floats  # (3 + n, p)
    known: Floats  # (3 + n,), M x'' + h = U phi + known
    torques: Floats  # (2n,)
    acceleration: Floats  # (3 + n,)
    joint_accelerations: Floats  # (n, 2)
    contact_forces: Floats  # (n, 2) as (F_x, F_n)
    estimate_rates: Floats  # (p,)
    lyapunov_value: float
    input_rank: int  # of B
    controllability: Floats  # (3,), diagonal of B B^+
    kinetic_energy: float
    potential_energy: float


def evaluate_state(
    scenario: Scenario,
    t: float,
    pose: ArrayLike,
    velocity: ArrayLike,
    slip: ArrayLike,
    slip_velocity: ArrayLike,
    phase: Sequence[int],
    estimates: ArrayLike,
    torque: ArrayLike | None = None,
) -> StateEvaluation:
    """Evaluates the closed loop at one state, in the given phase of every contact.

    Args:
        scenario: The hand.
        t: Time [s].
        pose: ``(3,)`` object pose.
        velocity: ``(3,)`` its derivative.
        slip: ``(n,)`` slip [m].
        slip_velocity: ``(n,)`` [m/s].
        phase: ``(n,)`` -1, 0 or 1, of the plant and of the controller's belief.
        estimates: ``(p,)``.
        torque: ``(2n,)`` joint torques [N m]; None for what the law commands.
    """
    n, p = len(scenario.fingers), len(scenario.estimates)
    model = pack_model(make_table(scenario), whole_faces())
    discrete, work = make_record(DISCRETE), make_record(WORKSPACE)
    discrete.phases[:n] = discrete.beliefs[:n] = phase
    discrete.piece = _piece_at(model.motion, t)
    state = make_record(STATE)
    parts = (pose, velocity, slip, slip_velocity, estimates)
    values = np.concatenate([np.asarray(part, dtype=float).ravel() for part in parts])
    state.x[: len(values)] = values
    call(update_mechanics, model, state, work)
    call(update_command, model, discrete, t, state, work)
    torques = np.zeros((n, 2))
    if torque is None:
        _forces_to_torques(work.kin, n, work.tip_forces, torques)
    else:
        torques[:] = np.reshape(np.asarray(torque, dtype=float), (n, 2))
        _torques_to_forces(work.kin, n, torques, work.tip_forces)
    call(solve_plant, model, discrete, work)
    call(adapt, model, discrete, state, work)
    return _collect(model, discrete, work, state, torques, n, p)


def evaluate_motion(scenario: Scenario, t: float, piece: int | None = None) -> Floats:
    """Desired pose, velocity and acceleration, ``(3, 3)``, one row each [m, m, rad, s].

    Args:
        scenario: Where the motion is described.
        t: Time [s].
        piece: Piece of the motion that holds, where two meet; the later one if left out.
    """
    path = pack_model(make_table(scenario), whole_faces()).motion
    k = _piece_at(path, t) if piece is None else piece
    return np.array([_desired_motion(path, k, t, coordinate) for coordinate in range(3)]).T


def _piece_at(path: Record, t: float) -> int:
    return int(np.searchsorted(path.breaks, t, side="right"))


def _collect(
    model: Record, discrete: Record, work: Record, state: Record, torques: Floats, n: int, p: int
) -> StateEvaluation:
    size = 3 + n
    kin = work.kin
    estimates = parts_of(state, n, p).estimates
    estimated_bias = np.zeros(size)
    believed, gravity = work.believed, model.hand.gravity
    _assemble_bias(kin, work.believed_dynamics, believed, gravity, discrete.beliefs, estimated_bias)
    acceleration = work.acceleration[:size].copy()
    estimated_inertia = work.estimated_inertia[:size, :size].copy()
    regressor = _regressor(model, discrete, work, size, p)
    value = _lyapunov_value(model.law, model.truth, model.unknowns, state, work.room)
    rank = call(find_controllable, model, discrete, work)
    kinetic, potential = _stored_energy(model.hand, model.truth, kin, state)
    return StateEvaluation(
        joint_positions=_joint_positions(model.hand, kin, n),
        joint_velocities=kin.joint_velocities[:n].copy(),
        finger_jacobians=kin.jacobians[:n].copy(),
        grasp_matrix=_grasp_matrix(model, kin, n),
        contact_frames=_contact_frames(kin, n),
        reduced_inertia=work.inertia[:size, :size].copy(),
        reduced_bias=work.bias[:size].copy(),
        reduced_input=_reduced_input(model, discrete, kin, n),
        estimated_reduced_inertia=estimated_inertia,
        estimated_reduced_bias=estimated_bias,
        regressor=regressor,
        known=estimated_inertia @ acceleration + estimated_bias - regressor @ estimates,
        torques=torques.ravel(),
        acceleration=acceleration,
        joint_accelerations=_joint_accelerations(kin, acceleration, n),
        contact_forces=work.forces[:n].copy(),
        estimate_rates=work.rates[:p].copy(),
        lyapunov_value=value,
        input_rank=rank,
        controllability=work.shares.copy(),
        kinetic_energy=kinetic,
        potential_energy=potential,
    )


def _joint_positions(hand: Record, kin: Record, n: int) -> Floats:
    return np.array([[_joint_position(hand, kin, i, k) for k in range(2)] for i in range(n)])


def _contact_frames(kin: Record, n: int) -> Floats:
    """C_i = R [x_c n], column by column."""
    tangents = kin.tangents[:n]
    normals = np.stack([tangents[:, 1], -tangents[:, 0]], axis=1)
    return np.stack([-tangents, normals], axis=2)


def _grasp_matrix(model: Record, kin: Record, n: int) -> Floats:
    """W of Eq. 4, one contact force at a time."""
    columns, stick = [], np.zeros(n, np.int64)
    for i, frame in enumerate(_contact_frames(kin, n)):
        for direction in frame.T:
            forces, column = np.zeros((n, 2)), np.zeros(3 + n)
            forces[i] = direction
            _apply_tip_forces(kin, model.truth, stick, forces, column)
            columns.append(column[:3])
    return np.stack(columns, axis=1)


def _reduced_input(model: Record, discrete: Record, kin: Record, n: int) -> Floats:
    """B~ of Eq. 18, one joint at a time."""
    columns = []
    for j in range(2 * n):
        torques, forces, column = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros(3 + n)
        torques[j // 2, j % 2] = 1.0
        _torques_to_forces(kin, n, torques, forces)
        _apply_tip_forces(kin, model.truth, discrete.phases, forces, column)
        columns.append(column)
    return np.stack(columns, axis=1)


def _regressor(model: Record, discrete: Record, work: Record, size: int, p: int) -> Floats:
    """U of Eq. 21 at the present acceleration, entry by entry."""
    regressor, products = np.zeros((size, p)), np.zeros(p)
    for row, weights in enumerate(np.eye(size)):
        _multiply_regressor(model, discrete, work, weights, products)
        regressor[row] = products
    return regressor


def _joint_accelerations(kin: Record, acceleration: Floats, n: int) -> Floats:
    tips = [np.array(_tip_acceleration(kin, i, acceleration)) + kin.bias[i] for i in range(n)]
    return np.stack([kin.inverses[i] @ tips[i] for i in range(n)])
