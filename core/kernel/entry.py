"""The entry point of the kernel and the types it is compiled for, once for all scenarios.

The closed loop is compiled by itself and reaches the hybrid loop as a function pointer:
otherwise its machine code would be generated again inside every function above it.
"""

from __future__ import annotations

import threading

import numba
from numba import types

from core.kernel import advance as hybrid
from core.kernel.compiler import cache_folder
from core.kernel.flow import DISCRETE, WORKSPACE, flow
from core.kernel.model import MODEL
from core.kernel.records import Record, make_record
from core.kernel.run import Outlet, make_outlet, make_progress

__all__ = ["advance", "is_cached", "new_outlet", "prepare"]

_LOCK = threading.Lock()


def prepare() -> None:
    """Loads the compiled kernel, or compiles it the first time; safe from any thread."""
    with _LOCK:
        if hybrid.advance.signatures:
            return
        model = numba.typeof(make_record(MODEL))
        discrete = numba.typeof(make_record(DISCRETE))
        work = numba.typeof(make_record(WORKSPACE))
        vector = types.Array(types.float64, 1, "C")
        signature = types.void(model, discrete, types.float64, vector, vector, work)
        flow.compile(signature)
        matrix = types.Array(types.float64, 2, "C")
        outlet = types.NamedTuple(
            (types.FunctionType(signature), matrix, matrix, vector), Outlet
        )
        run = numba.typeof(make_progress())
        hybrid.advance.compile(
            (model, run, outlet, types.float64, types.boolean, types.boolean, types.int64)
        )
        hybrid.advance.disable_compile()


def is_cached() -> bool:
    """Whether the kernel is loaded or lies compiled on disk; otherwise it takes seconds."""
    return bool(hybrid.advance.signatures) or any(cache_folder.rglob("advance.advance*.nbc"))


def new_outlet(num_columns: int, chatter_changes: int) -> Outlet:
    """Empty buffers for a run."""
    return make_outlet(flow, num_columns, chatter_changes)


def advance(
    model: Record,
    run: Record,
    outlet: Outlet,
    t_stop: float,
    first: bool,
    same_ticks: bool,
    max_steps: int,
) -> int:
    """Advances a run in compiled code; see `core.kernel.advance.advance`."""
    prepare()
    status: int = hybrid.advance(model, run, outlet, t_stop, first, same_ticks, max_steps)
    return status
