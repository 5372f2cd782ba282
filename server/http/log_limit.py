"""A bound on how fast the log grows, whatever clients do."""

from __future__ import annotations

import io
import logging
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import Any, TextIO

from slipgrasp.server.exceptions import printable
from slipgrasp.server.log_format import LogFormat

MAX_LINES = 10
PERIOD = 60.0
MAX_PRINTED = 200
"""How much is logged of a line that was printed."""

_logger = logging.getLogger(__name__)


class BoundedLog(logging.Handler):
    """Writes a few lines of a kind each minute to standard error, and how many it left out.

    Lines are of a kind if one statement wrote them with the same ``kind`` in `extra`.

    Args:
        log_format: What the lines are.
        max_lines: How many of a kind in a period.
        period: How long that is [s].
    """

    def __init__(
        self,
        log_format: LogFormat = LogFormat.TEXT,
        max_lines: int = MAX_LINES,
        period: float = PERIOD,
    ) -> None:
        super().__init__()
        self.setFormatter(log_format.formatter)
        self._max_lines = max_lines
        self._period = period
        self._kinds: dict[tuple[str, int, object], tuple[float, int]] = {}

    def emit(self, record: logging.LogRecord) -> None:
        """Writes a line, unless there were too many such; the next one reports their number."""
        kind = (record.pathname, record.lineno, getattr(record, "kind", None))
        now = time.monotonic()
        began, count = self._kinds.get(kind, (now, 0))
        record.left_out = 0
        if now - began >= self._period:
            record.left_out, began, count = max(count - self._max_lines, 0), now, 0
        self._kinds[kind] = began, count + 1
        if count < self._max_lines:
            # Looked up each time: the process may have replaced the stream.
            print(self.format(record), file=_beneath(sys.stderr), flush=True)


def log_config(log_format: LogFormat) -> dict[str, Any]:
    """How a server writes its log, as `logging.config.dictConfig` takes it."""
    handler = {"()": BoundedLog, "log_format": log_format}
    names = ("uvicorn", "slipgrasp", "asyncio", "websockets", "distributed", "py.warnings")
    loggers = {name: {"handlers": ["bounded"], "level": "WARNING"} for name in names}
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "handlers": {"bounded": handler},
        "loggers": loggers,
    }


def log_stray_errors(log_format: LogFormat) -> None:
    """Lets all that is wrong be lines of the log: what libraries log, warn of, and end threads by.

    Args:
        log_format: What the lines are.
    """
    logging.lastResort = BoundedLog(log_format)
    logging.captureWarnings(True)
    threading.excepthook = _log_end_of_thread


@contextmanager
def log_prints() -> Iterator[None]:
    """Within it, what Python code prints to standard output or standard error is logged.

    Libraries print errors, and clients can bring them to it as often as they like.
    """
    with redirect_stdout(_LoggedLines(sys.stdout)), redirect_stderr(_LoggedLines(sys.stderr)):
        yield


class _LoggedLines(io.TextIOBase):
    """A stream whose lines go to the log; each is cut off at a length.

    Args:
        beneath: The stream that the log itself writes to.
    """

    encoding = ""

    def __init__(self, beneath: TextIO) -> None:
        self.beneath, self.encoding = beneath, beneath.encoding
        self._unfinished = ""
        self._lock = threading.Lock()

    def fileno(self) -> int:
        """The descriptor beneath, for what is written past Python."""
        return self.beneath.fileno()

    def writable(self) -> bool:
        """True: it can be written to."""
        return True

    def write(self, text: str) -> int:
        """Logs the lines that are complete."""
        with self._lock:
            *lines, rest = (self._unfinished + text).split("\n")
            self._unfinished = rest[:MAX_PRINTED]
        for line in lines:
            if line.strip():
                _logger.warning("a library printed: %s", printable(line, MAX_PRINTED))
        return len(text)


def _beneath(stream: TextIO) -> TextIO:
    return stream.beneath if isinstance(stream, _LoggedLines) else stream


def _log_end_of_thread(end: threading.ExceptHookArgs) -> None:
    if end.exc_value is None or isinstance(end.exc_value, SystemExit):
        return
    name = end.thread.name if end.thread else "unknown"
    found = (end.exc_type, end.exc_value, end.exc_traceback)
    _logger.error("an unexpected error ended thread '%s'", name, exc_info=found)
