"""The entry point of the kernel: loaded or compiled once, then called from Python."""

from __future__ import annotations

from collections.abc import Callable

from slipgrasp.core.kernel import advance as hybrid
from slipgrasp.core.kernel.compiler import call, compile_from_the_end, prepare_units, share_ready
from slipgrasp.core.kernel.records import Record

__all__ = ["advance", "compile_from_the_end", "prepare", "share_ready"]


def prepare(progress: Callable[[float], None] | None = None) -> None:
    """Loads the compiled kernel, or compiles it the first time; safe from any thread.

    Args:
        progress: Called with the share of the kernel that is ready, 0 to 1.
    """
    prepare_units(progress)


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
