"""Memory needed by a fit, and the largest number of values to fit."""

from __future__ import annotations

from pathlib import Path

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.fit.problem import FitProblem
from slipgrasp.recordings.file.size import read_size
from slipgrasp.recordings.fit.request import FitRequest
from slipgrasp.recordings.measured.recording import is_measured, read_outline
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.server.budget import NUMBER_BYTES, RECORDED_RUN_BYTES, Need
from slipgrasp.server.exceptions import InvalidRequestError

MAX_VALUES = 500_000
"""Samples times signals, to which residuals, their derivatives and the journal are proportional."""

_COPIES = 30
"""Simultaneous arrays of all values: data, residuals, and derivatives by a dozen parameters."""


def need_of(request: FitRequest, runs: RecordingStore) -> Need:
    """Memory needed by a fit: its recordings while they are read, then its residuals.

    Raises:
        RecordingError: If a recording is missing or damaged.
    """
    sizes = [_numbers_in(path) for path in request.paths(runs)]
    reading = Need.to_read_numbers(sum(sizes)).num_bytes
    fitting = RECORDED_RUN_BYTES + _COPIES * NUMBER_BYTES * min(sizes[0], MAX_VALUES)
    return Need(
        max(reading, fitting),
        "this fit",
        "fit a shorter recording, or use 'slipgrasp fit' on the command line",
    )


def _numbers_in(path: Path) -> int:
    if is_measured(path):
        outline = read_outline(path)
        return outline.sampling.samples * (1 + len(outline.columns))
    return read_size(path).num_bytes // NUMBER_BYTES


def check_values(problem: FitProblem) -> None:
    """Rejects data with more values than a service fits.

    Raises:
        InvalidRequestError: If there are too many.
    """
    count = problem.data.count
    if count > MAX_VALUES:
        message = (
            f"signals: the recording has {count} values of these signals; this server fits at most "
            f"{MAX_VALUES}: choose fewer signals, import the data with --every N, or use "
            "'slipgrasp fit' on the command line"
        )
        limit = f"at most {MAX_VALUES} values"
        error = FieldError(field="signals", value=count, limit=limit, message=message)
        raise InvalidRequestError([error])
