"""State of a run of a body on a support, its initialization, and its output."""

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
from slipgrasp.core.kernel.loop.stages import set_stage
from slipgrasp.core.kernel.numerics.methods import MAX_SLOPES, method_of
from slipgrasp.core.kernel.support.flow import set_derivative, support_plant
from slipgrasp.core.kernel.support.model import MODEL
from slipgrasp.core.kernel.support.rows import (
    AT,
    ROW,
    TALLY,
    friction_margin,
    support_evaluate,
    support_fill,
    support_tally,
)
from slipgrasp.core.kernel.support.state import (
    DISCRETE,
    NUM_STATES,
    STATE,
    VX,
    WORKSPACE,
    X,
)
from slipgrasp.core.scenario.supported import SupportScenario

# A step from ``start`` to ``end`` with its slopes.
STEP = np.dtype(
    [
        ("rank", np.int64),  # of its method: 0
        ("start", STATE),
        ("end", STATE),
        ("slopes", STATE, (MAX_SLOPES,)),
    ],
    align=True,
)

# A step ends at a stop by its size: there are no guards.
_NO_GUARDS = np.dtype([("count", np.int64)])
_NO_LAW = np.dtype([("asked", np.int64)])
_JOINTS = 1  # at least, as the size of arrays

PROGRESS = progress_layout(
    [
        ("step", STEP),
        ("errors", np.float64, (NUM_STATES,)),  # of the step, per second
        ("inside", STEP),  # a part of the step
        ("discrete", DISCRETE),
        ("old", DISCRETE),
        ("work", WORKSPACE),
        ("guards", _NO_GUARDS),
        ("row", ROW),  # the last one evaluated
        ("last_row", ROW),  # the last one counted, if rows are not stored
        ("tally", TALLY),
        ("slip", slip_states_layout(STATE, DISCRETE, ROW, WORKSPACE)),
        ("own", _NO_LAW),
    ],
    _JOINTS,
)
OUTLET = outlet_layout(ROW, _JOINTS)
LAYOUTS = Layouts("support_", MODEL, STATE, DISCRETE, PROGRESS, OUTLET)


def make_run(scenario: SupportScenario, *, keeps_rows: bool) -> tuple[Record, Record]:
    """Returns a run at its start and empty output buffers."""
    run, outlet = make_record(PROGRESS), make_unset_record(OUTLET)
    run.hold_until = np.inf
    run.last_event = run.last_stick = -np.inf
    run.step_size = FIRST_STEP
    run.concerned = -1
    run.tally.last_slip = -np.inf
    run.tally.least_margin[:] = run.tally.row_margin[:] = np.inf
    run.step.start.x[X : X + 3] = scenario.motion.start
    run.step.start.x[VX : VX + 3] = scenario.motion.velocity
    outlet.keeps_rows = int(keeps_rows)
    outlet.num_rows = outlet.num_ticks = 0
    outlet["history"][: scenario.simulation.chatter_changes] = -np.inf
    return run, outlet


@compiled
def copy_discrete(_model: Record, source: Record, target: Record) -> None:
    """Copies the state that is constant between jumps."""
    target.phases[0] = source.phases[0]
    for part in range(3):
        target.direction[part] = source.direction[part]


_, _, emit_as_of, _, emit, emit_due, last_row = make_output(
    LAYOUTS, support_evaluate, support_fill, support_tally, copy_discrete
)


@compiled_apart(types.void, MODEL, DISCRETE, types.float64, STEP, WORKSPACE)
def support_step(model: Record, discrete: Record, h: float, step: Record, work: Record) -> None:
    """Fills ``end`` and ``slopes`` of a step of size ``h``."""
    for row in range(1, method_of(model, step).last + 1):
        set_stage(model, row, h, step, step.end)
        support_plant(model, discrete, step.end, work)
        set_derivative(model, step.end, step.slopes[row], work)


@compiled
def step_inside(model: Record, run: Record, h: float) -> None:
    """Repeats the last step with a shorter size, in ``run.inside``: as accurate as the step."""
    step, inside = run.step, run.inside
    for k in range(model.num_states):
        inside.start.x[k] = step.start.x[k]
        inside.slopes[0].x[k] = step.slopes[0].x[k]
    support_step(model, run.discrete, h, inside, run.work)


@compiled
def _sample(model: Record, run: Record, h: float, share: float, state: Record) -> None:
    """Computes the state at the fraction ``share`` of the last step."""
    step_inside(model, run, share * h)
    for k in range(model.num_states):
        state.x[k] = run.inside.end.x[k]


@compiled
def _never_past(
    _model: Record, _discrete: Record, _state: Record, _work: Record, _guards: Record
) -> int:
    """A state inside a step is never past the stop at its end."""
    return 0


follow_slip, leave_slip = make_slip_rows(
    LAYOUTS,
    sample=_sample,
    copy_discrete=copy_discrete,
    evaluate_row=support_evaluate,
    is_past_event=_never_past,
    fill_row=support_fill,
    friction_margin=friction_margin,
    dissipated=AT.dissipated_energy,
)
