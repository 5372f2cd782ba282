"""A bound on how fast the log grows, whatever clients do."""

from __future__ import annotations

import logging
import sys
import time
from typing import Any

MAX_LINES = 10
PERIOD = 60.0


class BoundedLog(logging.Handler):
    """Writes a few lines of a kind each minute to standard error, and how many it left out.

    Lines are of a kind if one statement wrote them.

    Args:
        max_lines: How many of a kind in a period.
        period: How long that is [s].
    """

    def __init__(self, max_lines: int = MAX_LINES, period: float = PERIOD) -> None:
        super().__init__()
        self._max_lines = max_lines
        self._period = period
        self._kinds: dict[tuple[str, int], tuple[float, int]] = {}

    def emit(self, record: logging.LogRecord) -> None:
        """Writes a line, unless there were too many such; the next one tells of them."""
        kind, now = (record.pathname, record.lineno), time.monotonic()
        began, count = self._kinds.get(kind, (now, 0))
        left_out = 0
        if now - began >= self._period:
            left_out, began, count = max(count - self._max_lines, 0), now, 0
        self._kinds[kind] = began, count + 1
        if count < self._max_lines:
            told = f" (and {left_out} more such before)" if left_out else ""
            # Looked up each time: whoever runs the server may have put another stream there.
            print(f"{self.format(record)}{told}", file=sys.stderr, flush=True)


def log_config() -> dict[str, Any]:
    """How a server writes its log, as `logging.config.dictConfig` takes it."""
    handler = {"()": BoundedLog}
    names = ("uvicorn", "slipgrasp", "asyncio", "websockets")
    loggers = {name: {"handlers": ["bounded"], "level": "WARNING"} for name in names}
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "handlers": {"bounded": handler},
        "loggers": loggers,
    }
