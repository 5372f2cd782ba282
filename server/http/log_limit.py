"""Limits the growth of the log, whatever clients do."""

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
"""Largest logged length of a printed line."""

_logger = logging.getLogger(__name__)


class BoundedLog(logging.Handler):
    """Writes a limited number of lines of a kind per minute, and counts the others.

    Lines are of a kind if they come from one statement with the same ``kind`` in `extra`.

    Args:
        log_format: Format of the lines.
        max_lines: Largest number of lines of a kind in a period.
        period: Length of a period [s].
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
        """Writes a line, unless there were too many of its kind; the next reports their number."""
        kind = (record.pathname, record.lineno, getattr(record, "kind", None))
        now = time.monotonic()
        began, count = self._kinds.get(kind, (now, 0))
        record.left_out = 0
        if now - began >= self._period:
            record.left_out, began, count = max(count - self._max_lines, 0), now, 0
        self._kinds[kind] = began, count + 1
        if count < self._max_lines:
            # Looked up each time, because the process may have replaced the stream.
            print(self.format(record), file=_beneath(sys.stderr), flush=True)


def log_config(log_format: LogFormat) -> dict[str, Any]:
    """Log configuration for `logging.config.dictConfig`."""
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
    """Sends all errors to the log: of libraries, warnings, and unhandled exceptions of threads.

    Args:
        log_format: Format of the lines.
    """
    logging.lastResort = BoundedLog(log_format)
    logging.captureWarnings(True)
    threading.excepthook = _log_end_of_thread


@contextmanager
def log_prints() -> Iterator[None]:
    """A context in which printed output of Python code is logged.

    Libraries print errors, and clients can cause any number of them.
    """
    with redirect_stdout(_LoggedLines(sys.stdout)), redirect_stderr(_LoggedLines(sys.stderr)):
        yield


class _LoggedLines(io.TextIOBase):
    """A stream whose lines go to the log, truncated to a length.

    Args:
        beneath: The stream of the log itself.
    """

    encoding = ""

    def __init__(self, beneath: TextIO) -> None:
        self.beneath, self.encoding = beneath, beneath.encoding
        self._unfinished = ""
        self._lock = threading.Lock()

    def fileno(self) -> int:
        """The descriptor of the underlying stream, for output outside Python."""
        return self.beneath.fileno()

    def writable(self) -> bool:
        """Always True: the stream is writable."""
        return True

    def write(self, text: str) -> int:
        """Logs complete lines."""
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
