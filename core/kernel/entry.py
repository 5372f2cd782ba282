"""The entry point of the kernel: loaded or compiled once, then called from Python."""

from __future__ import annotations

import threading

import numpy as np

from core.kernel import advance as hybrid
from core.kernel.compiler import cache_folder
from core.kernel.model import MODEL
from core.kernel.records import Record, make_record
from core.kernel.run import Outlet, make_outlet, make_progress

__all__ = ["advance", "is_cached", "prepare"]

_LOCK = threading.Lock()


def prepare() -> None:
    """Loads the compiled kernel, or compiles it the first time; safe from any thread."""
    with _LOCK:
        if not hybrid.advance.signatures:
            model, run, outlet = make_record(MODEL), make_progress(), make_outlet(1, 1, 1)
            run.begun, run.now = True, np.inf
            hybrid.advance(model, run, outlet, 0.0, False, False, 0)


def is_cached() -> bool:
    """Whether the kernel is loaded or lies compiled on disk; otherwise it takes a while."""
    return bool(hybrid.advance.signatures) or any(cache_folder.rglob("advance.advance*.nbc"))


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
