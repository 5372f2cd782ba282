"""Adaptation of the laws for spatial hands at a tick (Eq. 24, 28; composite adaptation).

Composite adaptation processes the equations of the object and of the slipping contacts by recursive
least squares, then adds the tracking term weighted with the previous covariance
(`slipgrasp.core.kernel.planar.laws.composite` is the planar version).
"""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Record
from slipgrasp.core.kernel.laws.grip_reflex import squeeze_harder
from slipgrasp.core.kernel.laws.gripper import approach_grip
from slipgrasp.core.kernel.laws.least_squares import (
    ACTIVE_BAND,
    LEAST_TRUST,
    begin_rows,
    forget,
    make_take_row,
    memory_layout,
    set_rates,
    weigh_tracking,
)
from slipgrasp.core.kernel.loop.model import FRICTION, LINK_MASS, OBJECT_INERTIA, OBJECT_MASS
from slipgrasp.core.kernel.numerics.elementary import square
from slipgrasp.core.kernel.spatial.dynamics import multiply
from slipgrasp.core.kernel.spatial.grasp_limits import tangential
from slipgrasp.core.kernel.spatial.inertia import fill_inertia
from slipgrasp.core.kernel.spatial.kinematics import moment_at_tip
from slipgrasp.core.kernel.spatial.law import (
    inertia_column,
    multiply_regressor,
    unit_force,
    weights_of_error,
)
from slipgrasp.core.kernel.spatial.model import LAW, MAX_COORDINATES, MODEL
from slipgrasp.core.kernel.spatial.plant import own_force, to_contact_frame, weigh_error
from slipgrasp.core.kernel.spatial.state import (
    SPIN,
    STATE,
    count_coordinates,
    slip_coordinate,
    slip_velocity_at,
)
from slipgrasp.core.kernel.spatial.ways import axes_of
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, WORKSPACE
from slipgrasp.core.scenario import MAX_UNKNOWNS

MEMORY = memory_layout(
    [
        ("before", np.float64, (MAX_UNKNOWNS, MAX_UNKNOWNS)),  # covariance before the rows
        ("slips", np.float64, (MAX_FINGERS, 2)),  # 1 for tangents in slip
        ("gamma", np.float64, (MAX_FINGERS, 3)),  # their directions
        ("moments", np.float64, (MAX_FINGERS,)),  # measured, of soft contacts on object [N m]
        ("inertia", np.float64, (MAX_COORDINATES, MAX_COORDINATES)),  # estimated M~
        ("forces", np.float64, (MAX_FINGERS, 3)),  # computed from torque and acceleration
        ("wrench", np.float64, (6,)),
    ]
)

_take_row = make_take_row("spatial_", LAW, MEMORY)


@compiled_apart(types.void, MODEL, DISCRETE, STATE, WORKSPACE, MEMORY)
def spatial_learn(
    model: Record, discrete: Record, state: Record, work: Record, memory: Record
) -> None:
    """Writes the rates of the estimates until the next tick to ``work.rates``.

    Args:
        model: Constants of the run.
        discrete: Discrete state, with the estimates.
        state: Measured state.
        work: Measured acceleration and tip forces, and the up-to-date estimated model.
        memory: Memory of the composite law, with trust, slips and their directions.
    """
    law, count = model.law, model.num_unknowns
    if law.facts.reacts_to_slip:
        squeeze_harder(model, discrete)
    if law.facts.holds_tips:
        approach_grip(model.law, discrete)
    if not law.facts.learns:
        for k in range(count):
            work.rates[k] = 0.0
        return
    weights_of_error(model, work.room)
    weigh_error(
        model.num_fingers, work.kin, work.believed_system, work.room.weights, work.room.weighted
    )
    multiply_regressor(model, state, work, work.room.weighted)
    if law.facts.has_memory:
        _learn_composite(model, discrete, state, work, memory)
        return
    sigma = _pull_back(model, discrete) if law.facts.pulls_back else 0.0
    for k in range(count):
        work.rates[k] = law.adaptation_gains[k] * work.rates[k] - sigma * discrete.estimates[k]


@compiled
def _pull_back(model: Record, discrete: Record) -> float:
    """sigma_s of Eq. 29."""
    total = 0.0
    for k in range(model.num_unknowns):
        total += square(discrete.estimates[k])
    return min(max(np.sqrt(total) / model.law.estimate_norm_bound - 1.0, 0.0), 1.0)


@compiled
def _learn_composite(
    model: Record, discrete: Record, state: Record, work: Record, memory: Record
) -> None:
    law, count = model.law, model.num_unknowns
    for k in range(count):
        memory.initial[k] = discrete.estimates[k]
    begin_rows(law, count, memory)
    for j in range(count):
        for k in range(count):
            memory.before[j, k] = memory.covariance[j, k]
    if memory.trust > LEAST_TRUST:
        _find_forces(model, work, memory)
        _find_inertia(model, work, memory)
        _take_object_rows(model, state, work, memory)
        _take_slip_rows(model, state, work, memory)
    weigh_tracking(count, memory.before, work.rates, memory)
    forget(law, count, memory)
    set_rates(model, work, memory, _is_probed)


@compiled
def _is_probed(model: Record, work: Record, memory: Record, k: int) -> bool:
    """True if unknown ``k`` is the friction of a contact that never slipped and limits the grip."""
    i, force = model.unknowns.fingers[k], work.grasp.force
    slips = memory.slips[i, 0] != 0.0 or memory.slips[i, 1] != 0.0
    if model.unknowns.kinds[k] != FRICTION or memory.known[i] == 1 or slips:
        return False
    bound = (1.0 - ACTIVE_BAND) * work.believed.friction[i] / model.law.grip_safety
    for way in range(model.ways):
        size = tangential(work.grasp, i, way)
        if size > bound * force[3 * i + 2]:
            return True
    return False


@compiled
def _find_forces(model: Record, work: Record, memory: Record) -> None:
    """Computes the forces of the fingertips on the object from the estimated model, world axes."""
    for k in range(6):
        memory.wrench[k] = 0.0
    for i in range(model.num_fingers):
        x, y, z = own_force(
            work.kin, work.believed_dynamics, i, work.acceleration, work.slip_acceleration
        )
        fx, fy = work.tip_forces[i, 0] - x, work.tip_forces[i, 1] - y
        fz = work.tip_forces[i, 2] - z
        if model.soft == 1:
            fx, fy, fz = _take_off_moment(model, work, memory, i, fx, fy, fz)
        memory.forces[i, 0], memory.forces[i, 1], memory.forces[i, 2] = fx, fy, fz
        rx, ry, rz = work.kin.arms[i, 0], work.kin.arms[i, 1], work.kin.arms[i, 2]
        memory.wrench[0] += fx
        memory.wrench[1] += fy
        memory.wrench[2] += fz
        memory.wrench[3] += ry * fz - rz * fy
        memory.wrench[4] += rz * fx - rx * fz
        memory.wrench[5] += rx * fy - ry * fx


@compiled
def _take_off_moment(
    model: Record, work: Record, memory: Record, i: int, fx: float, fy: float, fz: float
) -> tuple[float, float, float]:
    """Tip force without the part due to the contact moment; adds the moment to the wrench."""
    normal, moment = work.kin.frames[i, 2], memory.moments[i]
    x, y, z = moment_at_tip(model.hand, work.kin, i, normal[0], normal[1], normal[2])
    for k in range(3):
        memory.wrench[3 + k] += moment * normal[k]
    return fx - moment * x, fy - moment * y, fz - moment * z


@compiled
def _find_inertia(model: Record, work: Record, memory: Record) -> None:
    """Computes the estimated M~, which maps acceleration noise to the equations."""
    if model.law.acceleration_variance > 0.0:
        fill_inertia(
            work.kin,
            work.believed_dynamics,
            work.believed,
            work.room.slips,
            work.believed_system,
            memory.inertia,
        )


@compiled
def _row_noise(
    model: Record, work: Record, memory: Record, line: int, first: float, second: float
) -> float:
    """Variance of a combination of two rows of M~ due to noise of the differenced velocities."""
    variance, total = model.law.acceleration_variance, 0.0
    if variance == 0.0:
        return 0.0
    for k in range(count_coordinates(model.num_fingers)):
        if k < 6 or work.room.slips[k // 2 - 3, k % 2] != 0.0:
            part = first * memory.inertia[line, k]
            if second != 0.0:
                part += second * memory.inertia[line + 1, k]
            total += square(part)
    return variance * total


@compiled
def _take_object_rows(model: Record, state: Record, work: Record, memory: Record) -> None:
    """Processes the equations of the object: three forces, three moments."""
    n, a, believed, x = model.num_fingers, work.acceleration, work.believed, state.x
    variance, reach = model.law.force_variance, 0.0
    scale = 1.0 / square(memory.trust)
    for i in range(n):
        for k in range(3):
            reach += square(work.kin.arms[i, k]) / n
    body = work.believed_system.body
    ax, ay, az = multiply(body, a[3], a[4], a[5])
    lx, ly, lz = multiply(body, x[SPIN], x[SPIN + 1], x[SPIN + 2])
    wx, wy, wz = x[SPIN], x[SPIN + 1], x[SPIN + 2]
    mass, lift = believed.object_mass, a[2] + model.hand.gravity
    needed = (
        mass * a[0],
        mass * a[1],
        mass * lift,
        ax + wy * lz - wz * ly,
        ay + wz * lx - wx * lz,
        az + wx * ly - wy * lx,
    )
    for row in range(6):
        _fill_object_row(model, state, work, memory, row)
        noise = variance if row < 3 else variance * reach
        noise = scale * (noise + _row_noise(model, work, memory, row, 1.0, 0.0))
        _take_row(model.law, model.num_unknowns, memory, memory.wrench[row] - needed[row], noise)


@compiled
def _fill_object_row(model: Record, state: Record, work: Record, memory: Record, row: int) -> None:
    kin, a, unknowns = work.kin, work.acceleration, model.unknowns
    for k in range(unknowns.count):
        kind, i, link = unknowns.kinds[k], unknowns.fingers[k], unknowns.links[k]
        memory.row[k] = 0.0
        if kind == OBJECT_MASS and row < 3:
            memory.row[k] = a[row] + (model.hand.gravity if row == 2 else 0.0)
        elif kind == OBJECT_INERTIA and row >= 3:
            moment = inertia_column(kin, state, a, link)
            memory.row[k] = moment[row - 3]
        elif kind == LINK_MASS:
            fx, fy, fz = unit_force(kin, work, i, link)
            rx, ry, rz = kin.arms[i, 0], kin.arms[i, 1], kin.arms[i, 2]
            wrench = (fx, fy, fz, ry * fz - rz * fy, rz * fx - rx * fz, rx * fy - ry * fx)
            memory.row[k] = wrench[row]


@compiled
def _take_slip_rows(model: Record, state: Record, work: Record, memory: Record) -> None:
    """Processes the equations of the slipping contacts: F_n mu = -g . F_t."""
    unknowns, kin = model.unknowns, work.kin
    for i in range(model.num_fingers):
        trust = memory.trust * memory.contact_trust[i]
        if trust < LEAST_TRUST:
            continue
        force = to_contact_frame(
            kin, i, memory.forces[i, 0], memory.forces[i, 1], memory.forces[i, 2]
        )
        mu = work.believed.friction[i]
        for way in range(model.ways):
            if memory.slips[i, way] == 0.0 or not _is_measured(model, state, memory, i, way):
                continue
            for k in range(unknowns.count):
                memory.row[k] = 0.0
                if unknowns.fingers[k] != i:
                    continue
                if unknowns.kinds[k] == FRICTION:
                    memory.row[k] = force[2]
                else:
                    fx, fy, fz = unit_force(kin, work, i, unknowns.links[k])
                    unit = to_contact_frame(kin, i, fx, fy, fz)
                    memory.row[k] = _along(model, memory, i, way, unit) - mu * unit[2]
            error = _along(model, memory, i, way, force) - mu * force[2]
            if model.soft == 1 and model.hand.eccentricities[i] > 0.0:
                error += memory.gamma[i, 2] * memory.moments[i] / model.hand.eccentricities[i]
            variance = model.law.force_variance + _slip_noise(model, work, memory, i, way)
            _take_row(model.law, model.num_unknowns, memory, error, variance / square(trust))
            memory.known[i] = 1


@compiled
def _along(
    model: Record, memory: Record, i: int, way: int, force: tuple[float, float, float]
) -> float:
    """-g . F_t over the tangents of a slip mode."""
    total = 0.0
    for axis in axes_of(model, way):
        total -= memory.gamma[i, axis] * (force[0] if axis == 0 else force[1])
    return total


@compiled
def _is_measured(model: Record, state: Record, memory: Record, i: int, way: int) -> bool:
    """True if a detected slip is certain: its measured velocity is above ``slip_level``."""
    along = 0.0
    for axis in axes_of(model, way):
        speed = state.x[slip_velocity_at(model.num_fingers, i, axis)]
        along += memory.gamma[i, axis] * speed
    return along > model.law.slip_level


@compiled
def _slip_noise(model: Record, work: Record, memory: Record, i: int, way: int) -> float:
    """Variance of the equation of a slip due to noise of the accelerations."""
    line, gamma = slip_coordinate(i, 0), work.room.gamma[i]
    if model.ways == 2:
        return _row_noise(model, work, memory, line + way, 1.0, 0.0)
    return _row_noise(model, work, memory, line, gamma[0], gamma[1])
