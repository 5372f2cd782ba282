"""What an accepted step of a planar run adds to the metrics, the extremes inside it included."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.extremes import make_count_extremes
from slipgrasp.core.kernel.numerics.methods import method_of
from slipgrasp.core.kernel.planar.dips import value_inside
from slipgrasp.core.kernel.planar.guards import PER_CONTACT, evaluate_ends
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.run import LAYOUTS, PROGRESS
from slipgrasp.core.kernel.planar.stepper import take_step
from slipgrasp.core.kernel.planar.tally import add_step


@compiled
def _count_ways(_model: Record) -> int:
    """A planar contact slips one way at a time."""
    return 1


_count_extremes = make_count_extremes(LAYOUTS, PER_CONTACT, _count_ways, value_inside)


@compiled_apart(types.void, MODEL, PROGRESS, types.float64)
def count_step(model: Record, run: Record, h: float) -> None:
    """Adds the step of size ``h`` from the present state on to the metrics.

    Where the law jumps at its end the forces there are those of neither side: those up to just
    before the jump count.
    """
    discrete, guards, step, work = run.discrete, run.guards, run.step, run.work
    add_step(model, discrete, step, run.now, h, run.tally)
    if run.fired == 1 and guards.fired[guards.count - 1] == 1:
        before = run.before_time - run.now
        if before > 0.0:
            take_step(model, discrete, run.now, before, step, work)
            evaluate_ends(model, discrete, step.end, work, guards)
            _count_extremes(model, run, before)
        take_step(model, discrete, run.now, h, step, work)
    else:
        _count_extremes(model, run, h)
    step.efforts[0] = step.efforts[method_of(model, step).last]
