"""State of a spatial run, its initialization, and its output."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import call, compiled, compiled_apart
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
from slipgrasp.core.kernel.spatial.chain import copy_seed
from slipgrasp.core.kernel.spatial.contact_problem import SELECTION_ROOM
from slipgrasp.core.kernel.spatial.guards import GUARDS, is_past_event
from slipgrasp.core.kernel.spatial.learning import MEMORY
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.own_law import OWN_LAW
from slipgrasp.core.kernel.spatial.prediction import PREDICTION
from slipgrasp.core.kernel.spatial.rows import (
    AT,
    ROW,
    spatial_evaluate,
    spatial_fill,
)
from slipgrasp.core.kernel.spatial.sensing import SENSES
from slipgrasp.core.kernel.spatial.state import STATE, normalise, parts_of
from slipgrasp.core.kernel.spatial.stepper import STEP, state_inside
from slipgrasp.core.kernel.spatial.tally import TALLY, spatial_tally
from slipgrasp.core.kernel.spatial.torsion_directions import is_short
from slipgrasp.core.kernel.spatial.ways import least_margin
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, WORKSPACE
from slipgrasp.core.scenario.space import SPATIAL
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import first_seeds

PROGRESS = progress_layout(
    [
        ("step", STEP),
        ("discrete", DISCRETE),
        ("old", DISCRETE),
        ("old_state", STATE),  # before a jump, for soft fingertips
        ("work", WORKSPACE),
        ("selection", SELECTION_ROOM),
        ("guards", GUARDS),
        ("row", ROW),  # the last one evaluated
        ("last_row", ROW),  # the last one counted, if rows are not stored
        ("tally", TALLY),
        ("slip", slip_states_layout(STATE, DISCRETE, ROW, WORKSPACE)),
        ("senses", SENSES),
        ("memory", MEMORY),
        ("own", OWN_LAW),
        ("prediction", PREDICTION),
    ],
    SPATIAL.joints_per_finger,
)
OUTLET = outlet_layout(ROW, SPATIAL.joints_per_finger)
LAYOUTS = Layouts("spatial_", MODEL, STATE, DISCRETE, PROGRESS, OUTLET)


def make_run(scenario: SpatialScenario, *, keeps_rows: bool) -> tuple[Record, Record]:
    """Returns a run at its start and empty output buffers."""
    run, outlet = make_record(PROGRESS), make_unset_record(OUTLET)
    run.hold_until = np.inf
    run.last_event = run.last_stick = -np.inf
    run.step_size = FIRST_STEP
    run.concerned = -1
    run.tally.last_slip = -np.inf
    run.tally.least_margin[:] = run.tally.row_margin[:] = np.inf
    parts_of(run.step.start, len(scenario.fingers)).pose[:] = scenario.trajectory.start
    call(spatial_normalise, run.step.start)
    for k, estimate in enumerate(scenario.estimates):
        run.discrete.estimates[k] = estimate.initial
    run.discrete.seeds["positions"][: len(scenario.fingers)] = first_seeds(scenario)
    run.discrete.closing_force = scenario.controller.grip_force
    outlet.keeps_rows = int(keeps_rows)
    outlet.num_rows = outlet.num_ticks = 0
    outlet["history"][: scenario.simulation.chatter_changes] = -np.inf
    return run, outlet


@compiled_apart(types.void, STATE)
def spatial_normalise(state: Record) -> None:
    """Normalizes the attitude quaternion."""
    normalise(state)


@compiled
def copy_discrete(model: Record, source: Record, target: Record) -> None:
    """Copies the state that is constant between jumps."""
    for i in range(model.num_fingers):
        target.phases[i], target.beliefs[i] = source.phases[i], source.beliefs[i]
        for axis in range(2):
            target.frozen[i, axis] = source.frozen[i, axis]
            target.slips[i, axis] = source.slips[i, axis]
        for part in range(3):
            target.directions[i, part] = source.directions[i, part]
        for joint in range(3):
            target.torques[i, joint] = source.torques[i, joint]
            target.commanded[i, joint] = source.commanded[i, joint]
        for part in range(3 if model.soft == 1 else 0):
            target.crept[i, part] = source.crept[i, part]
        if model.hand.has_chains == 1:
            copy_seed(source.seeds[i], target.seeds[i])
    for k in range(model.num_unknowns):
        target.estimates[k] = source.estimates[k]
    target.violation, target.piece = source.violation, source.piece
    target.added_grip = source.added_grip
    target.closing_force = source.closing_force
    for k in range(model.num_diagnostics):
        target.diagnostics[k] = source.diagnostics[k]


_, _, emit_as_of, _, _emit, emit_due, last_row = make_output(
    LAYOUTS, spatial_evaluate, spatial_fill, spatial_tally, copy_discrete
)


@compiled
def emit(model: Record, run: Record, outlet: Record, discrete: Record) -> None:
    """Appends a row for the current state and time."""
    run.work.at_start = 0
    _emit(model, run, outlet, discrete)


@compiled
def _state_inside(model: Record, run: Record, h: float, fraction: float, state: Record) -> None:
    """Interpolates the state inside the step just taken."""
    state_inside(model, run.step, h, fraction, state)


@compiled
def _evaluate_inside(model: Record, row: Record, work: Record) -> int:
    """As `spatial_evaluate`; also 0 if a soft contact at slip onset comes to rest in the step.

    The friction of that contact is inside its limit surface, which no row of a slip can show.
    """
    for i in range(model.num_fingers if model.soft == 1 else 0):
        if row.discrete.frozen[i, 0] == 1 and is_short(row.discrete.directions, i):
            return 0
    return spatial_evaluate(model, row, work)


follow_slip, leave_slip = make_slip_rows(
    LAYOUTS,
    sample=_state_inside,
    copy_discrete=copy_discrete,
    evaluate_row=_evaluate_inside,
    is_past_event=is_past_event,
    fill_row=spatial_fill,
    friction_margin=least_margin,
    dissipated=AT.dissipated_energy,
)
