"""Format of the log: text for people, or JSON for programs; one line per event."""

from __future__ import annotations

import json
import logging
from datetime import UTC, datetime
from enum import StrEnum


class LogFormat(StrEnum):
    """Format of the lines of a log."""

    TEXT = "text"
    JSON = "json"

    @property
    def formatter(self) -> logging.Formatter:
        """The formatter of records; ``left_out`` is the number of preceding dropped lines."""
        return _JsonLines() if self is LogFormat.JSON else _TextLines()


class _TextLines(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        left_out = getattr(record, "left_out", 0)
        told = f" (and {left_out} more before)" if left_out else ""
        return f"{super().format(record)}{told}"


class _JsonLines(logging.Formatter):
    """Objects with time, level, logger and message; some have left_out and exception too."""

    def format(self, record: logging.LogRecord) -> str:
        told: dict[str, str | int] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        if left_out := getattr(record, "left_out", 0):
            told["left_out"] = left_out
        if record.exc_info:
            told["exception"] = self.formatException(record.exc_info)
        # Escaped, so that text from clients cannot end the line.
        return json.dumps(told)
