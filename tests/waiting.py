"""Waiting for what must happen, however long the machine takes."""

from __future__ import annotations

import time
from collections.abc import Callable

PATIENCE = 240.0
"""When a test gives up on what will not happen any more [s]; no assertion about speed."""


def wait_until(
    holds: Callable[[], object], what: str | Callable[[], object] = "it did not happen"
) -> None:
    """Waits until something is true.

    Args:
        holds: Whether it is.
        what: What did not happen, should it never become true; may be found out then.
    """
    deadline, pause = time.monotonic() + PATIENCE, 0.002
    while not holds():
        assert time.monotonic() < deadline, what() if callable(what) else what
        time.sleep(pause)
        pause = min(2.0 * pause, 0.05)
