"""The entry point of the kernel: loaded or compiled once, then called from Python."""

from __future__ import annotations

from slipgrasp.core.kernel import advance as hybrid
from slipgrasp.core.kernel.compiler import call
from slipgrasp.core.kernel.records import Record


def advance(
    model: Record,
    run: Record,
    outlet: Record,
    t_stop: float,
    *,
    first: bool,
    same_ticks: bool,
    max_steps: int,
) -> int:
    """Advances a run in compiled code, without the GIL (`slipgrasp.core.kernel.advance`)."""
    flags = int(first), int(same_ticks)
    status: int = call(hybrid.advance, model, run, outlet, t_stop, *flags, max_steps)
    return status
