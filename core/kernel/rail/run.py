"""State of a run on a rail, its initialization, its steps and its output."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import (
    Record,
    make_record,
    make_unset_record,
)
from slipgrasp.core.kernel.loop.output import make_output
from slipgrasp.core.kernel.loop.progress import (
    FIRST_STEP,
    Layouts,
    outlet_layout,
    progress_layout,
    slip_states_layout,
)
from slipgrasp.core.kernel.loop.slip_rows import make_slip_rows
from slipgrasp.core.kernel.loop.stages import fill_terms, interpolate, set_stage
from slipgrasp.core.kernel.numerics.methods import DENSE_ROWS, MAX_SLOPES, method_of
from slipgrasp.core.kernel.planar.state import MAX_STATE, STATE
from slipgrasp.core.kernel.rail.flow import effort_rate, flow
from slipgrasp.core.kernel.rail.guards import (
    GUARDS,
    MAX_GUARDS,
    friction_margin,
    is_past_event,
    sample_guards,
)
from slipgrasp.core.kernel.rail.model import MODEL
from slipgrasp.core.kernel.rail.rows import (
    AT,
    ROW,
    TALLY,
    rail_evaluate_row,
    rail_fill,
    rail_tally,
)
from slipgrasp.core.kernel.rail.state import DISCRETE, MASS, POSITION, WORKSPACE
from slipgrasp.core.scenario.rail import RailScenario

# A step from ``start`` to ``end`` with its slopes.
STEP = np.dtype(
    [
        ("rank", np.int64),  # of its method: 0
        ("start", STATE),
        ("end", STATE),
        ("slopes", STATE, (MAX_SLOPES,)),
        ("stage", STATE),
        ("terms", np.float64, (DENSE_ROWS + 3, MAX_STATE)),  # of the interpolant
        ("prepared", np.int64),  # 1 if the terms belong to this step
        ("samples", np.float64, (MAX_SLOPES, MAX_GUARDS)),  # of guards, at the stages
        ("efforts", np.float64, (MAX_SLOPES,)),  # squared torques at the stages [N^2 m^2]
    ],
    align=True,
)

_NO_LAW = np.dtype([("asked", np.int64)])
_JOINTS = 2

PROGRESS = progress_layout(
    [
        ("step", STEP),
        ("discrete", DISCRETE),
        ("old", DISCRETE),
        ("work", WORKSPACE),
        ("slope", STATE),  # inside a step
        ("guards", GUARDS),
        ("row", ROW),  # the last one evaluated
        ("last_row", ROW),  # the last one counted, if rows are not stored
        ("tally", TALLY),
        ("slip", slip_states_layout(STATE, DISCRETE, ROW, WORKSPACE)),
        ("own", _NO_LAW),
    ],
    _JOINTS,
)
OUTLET = outlet_layout(ROW, _JOINTS)
LAYOUTS = Layouts("rail_", MODEL, STATE, DISCRETE, PROGRESS, OUTLET)


def make_run(scenario: RailScenario, *, keeps_rows: bool) -> tuple[Record, Record]:
    """Returns a run at its start and empty output buffers."""
    run, outlet = make_record(PROGRESS), make_unset_record(OUTLET)
    run.hold_until = np.inf
    run.last_event = run.last_stick = -np.inf
    run.step_size = FIRST_STEP
    run.concerned = -1
    run.tally.last_slip = -np.inf
    run.tally.least_margin[:] = run.tally.row_margin[:] = np.inf
    run.step.start.x[POSITION] = scenario.trajectory.start[0]
    for estimate in scenario.estimates:
        run.step.start.x[MASS] = estimate.initial
    outlet.keeps_rows = int(keeps_rows)
    outlet.num_rows = outlet.num_ticks = 0
    outlet["history"][: scenario.simulation.chatter_changes] = -np.inf
    return run, outlet


@compiled
def copy_discrete(_model: Record, source: Record, target: Record) -> None:
    """Copies the state that is constant between jumps."""
    for i in range(2):
        target.phases[i] = source.phases[i]
    target.piece = source.piece


evaluate_at, store_row, _, emit_or_end, emit, emit_due, last_row = make_output(
    LAYOUTS, rail_evaluate_row, rail_fill, rail_tally, copy_discrete
)


@compiled_apart(types.void, MODEL, DISCRETE, types.float64, types.float64, STEP, WORKSPACE)
def rail_step(
    model: Record, discrete: Record, t: float, h: float, step: Record, work: Record
) -> None:
    """Fills ``end`` and ``slopes``; ``work`` is then evaluated at the end of the step."""
    method = method_of(model, step)
    for row in range(1, method.last + 1):
        set_stage(model, row, h, step, step.end)
        flow(model, discrete, t + method.nodes[row] * h, step.end, step.slopes[row], work)
        sample_guards(model, discrete, work, step.samples, row)
        step.efforts[row] = effort_rate(work)
    step.prepared = 0


@compiled_apart(types.void, MODEL, DISCRETE, types.float64, types.float64, STEP, WORKSPACE)
def rail_prepare(
    model: Record, discrete: Record, t: float, h: float, step: Record, work: Record
) -> None:
    """Fills ``terms`` for `interpolate` once; ``work`` is then evaluated inside the step."""
    if step.prepared == 1:
        return
    step.prepared = 1
    method = method_of(model, step)
    for row in range(method.last + 1, method.num_slopes):
        set_stage(model, row, h, step, step.stage)
        flow(model, discrete, t + method.nodes[row] * h, step.stage, step.slopes[row], work)
    fill_terms(model, h, step)


@compiled
def _sample(model: Record, run: Record, h: float, share: float, state: Record) -> None:
    """Computes the state at the fraction ``share`` of the last step."""
    rail_prepare(model, run.discrete, run.now, h, run.step, run.slip.work)
    interpolate(model, run.step, share, state)


follow_slip, leave_slip = make_slip_rows(
    LAYOUTS,
    sample=_sample,
    copy_discrete=copy_discrete,
    evaluate_row=rail_evaluate_row,
    is_past_event=is_past_event,
    fill_row=rail_fill,
    friction_margin=friction_margin,
    dissipated=AT.dissipated_energy,
)
