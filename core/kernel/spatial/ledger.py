"""Energy imbalance of a step of a spatial run, checked at fast rotation of object or joints."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.ledger import FAST_RATE, allowed_imbalance, make_energy_balance
from slipgrasp.core.kernel.spatial.dynamics import stored_energy
from slipgrasp.core.kernel.spatial.kinematics import update_kinematics
from slipgrasp.core.kernel.spatial.model import MODEL
from slipgrasp.core.kernel.spatial.run import PROGRESS
from slipgrasp.core.kernel.spatial.state import SPIN, dissipated_at, supplied_at
from slipgrasp.core.kernel.spatial.stepper import state_inside

NEARLY_SINGULAR = 1e-2  # extension of a finger below which every step is checked

_balance = make_energy_balance(stored_energy, supplied_at, dissipated_at)


@compiled
def turns_fast(model: Record, run: Record) -> bool:
    """True if the object or a joint rotates fast at the end of the step, as near singular poses."""
    fastest, end, rates = 0.0, run.step.end.x, run.work.kin.rates
    for k in range(3):
        fastest = max(fastest, abs(float(end[SPIN + k])))
    for i in range(model.num_fingers):
        for joint in range(3):
            fastest = max(fastest, abs(float(rates[i, joint])))
    return fastest > FAST_RATE


@compiled
def is_nearly_singular(model: Record, run: Record) -> bool:
    """True if a finger of a hand with soft fingertips is nearly singular at the end of the step.

    Its joints then turn by much more than the error of its tip.
    """
    for i in range(model.num_fingers if model.soft == 1 else 0):
        if run.work.kin.extension[i] < NEARLY_SINGULAR:
            return True
    return False


@compiled_apart(types.float64, MODEL, PROGRESS, types.float64)
def spatial_imbalance(model: Record, run: Record, h: float) -> float:
    """Energy imbalance at the midpoint and end of a step, relative to the tolerance; the larger."""
    step, inside, kin = run.step, run.selection.probe, run.slip.work.kin
    end, kinetic = _balance(model, step.end, run.work.kin)
    update_kinematics(model.hand, run.discrete.seeds, step.start, kin)
    start, _ = _balance(model, step.start, kin)
    state_inside(model, step, h, 0.5, inside)
    update_kinematics(model.hand, run.discrete.seeds, inside, kin)
    middle, _ = _balance(model, inside, kin)
    supplied = step.end.x[supplied_at(model)]
    allowed = allowed_imbalance(model.numerics, kinetic, supplied)
    return max(abs(end - start), abs(middle - start)) / allowed
