"""What all tests share: the compiled kernel, and how the processes they start are to behave."""

from __future__ import annotations

import os
import signal

from core.simulator import prepare_kernel


def pytest_sessionstart() -> None:
    """Makes ready what tests and the processes they start rely on."""
    # Hundreds of processes: each would compile all modules again.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    # A shell that starts the tests in the background makes them, and their processes, deaf.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # So that neither a test nor two processes at once do it.
    prepare_kernel()
