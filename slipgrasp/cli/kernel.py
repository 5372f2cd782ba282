"""Loads the simulation, and tells whoever waits while it is compiled for the first time."""

from __future__ import annotations

from slipgrasp.cli.progress import COMPILING, Progress


def load_simulation() -> None:
    """Returns when runs can start."""
    with Progress("loading the simulation") as progress:
        from slipgrasp.core.run.simulator import kernel_is_cached, prepare_kernel

        if not kernel_is_cached():
            progress.announce(COMPILING)
        prepare_kernel(progress.update)
