"""Rows of the trace of a body on a support, and its accumulators of the metrics."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.friction import present_friction
from slipgrasp.core.kernel.loop.rows import (
    make_fill_shared,
    place_signals,
    row_layout,
    set_value,
)
from slipgrasp.core.kernel.loop.tally import add_row, tally_layout
from slipgrasp.core.kernel.support.flow import stored_energy, support_plant
from slipgrasp.core.kernel.support.model import MODEL
from slipgrasp.core.kernel.support.state import (
    DISCRETE,
    DISSIPATED,
    OMEGA,
    PATH,
    STATE,
    SUPPLIED,
    THETA,
    TURNED,
    VX,
    WORKSPACE,
    X,
)
from slipgrasp.core.scenario.space import SUPPORT

AT = place_signals(SUPPORT)
ROW = row_layout(STATE, DISCRETE, [], SUPPORT)
TALLY = tally_layout(0, [("spin_path", np.float64, (1,)), ("spin_end", np.float64, (1,))])


@compiled
def _true_value(_truth: Record, _unknowns: int, _k: int) -> float:
    """Nothing is estimated."""
    return 0.0


_fill_shared = make_fill_shared(AT, _true_value)


@compiled_apart(types.int64, MODEL, ROW, WORKSPACE)
def support_evaluate(model: Record, row: Record, work: Record) -> int:
    """Evaluates the state of ``row``; 0 if a value is not finite."""
    support_plant(model, row.discrete, row.state, work)
    kinetic, potential = stored_energy(model.hand, model.truth, work.kin, row.state)
    row.kinetic_energy, row.potential_energy = kinetic, potential
    total = kinetic + potential
    for k in range(model.num_states):
        total += abs(row.state.x[k])
    for part in range(3):
        total += abs(work.acceleration[part]) + abs(work.forces[0, part])
    return 1 if abs(total) < np.inf else 0


@compiled_apart(types.void, MODEL, ROW, WORKSPACE)
def support_fill(model: Record, row: Record, work: Record) -> None:
    """Writes the signals of an evaluated row; those of hands remain 0."""
    x, discrete, start = row.state.x, row.discrete, model.hand.start
    _fill_shared(model, row, x[SUPPLIED], x[DISSIPATED])
    for part in range(3):
        set_value(model, row, AT.object_pose, part, x[X + part])
        set_value(model, row, AT.object_velocity, part, x[VX + part])
        set_value(model, row, AT.object_acceleration, part, work.acceleration[part])
        set_value(model, row, AT.external_wrench, part, model.load[part])
    for axis in range(2):
        set_value(model, row, AT.slip, axis, x[X + axis] - start[axis])
        set_value(model, row, AT.slip_velocity, axis, x[VX + axis])
        set_value(model, row, AT.slip_acceleration, axis, work.acceleration[axis])
        set_value(model, row, AT.tangential_force, axis, work.forces[0, axis])
    set_value(model, row, AT.slip_path, 0, x[PATH])
    set_value(model, row, AT.phase, 0, discrete.phases[0])
    set_value(model, row, AT.normal_force, 0, work.forces[0, 2])
    set_value(model, row, AT.friction_margin, 0, work.margin)
    set_value(model, row, AT.friction_coefficient, 0, present_friction(model, discrete, 0))
    first = row.length
    row.values[first] = x[THETA] - start[2]
    row.values[first + 1] = x[OMEGA]
    row.values[first + 2] = work.moment
    row.length = first + 3


@compiled
def friction_margin(_model: Record, _discrete: Record, work: Record, _i: int) -> float:
    """Friction margin of the evaluated state [N]."""
    return work.margin


@compiled_apart(types.void, MODEL, ROW, WORKSPACE, TALLY)
def support_tally(model: Record, row: Record, work: Record, tally: Record) -> None:
    """Adds an evaluated row to the metrics.

    Forces in stick are constant during a segment, so that rows have their extremes.
    """
    x = row.state.x
    tally.slip_path[0], tally.spin_path[0] = x[PATH], x[TURNED]
    tally.spin_end[0] = x[THETA] - model.hand.start[2]
    add_row(model, row, work, tally, 0.0, friction_margin)
