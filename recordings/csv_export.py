"""A run as a table of text: one row per sample, nothing lost."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from core.result import RunResult
from core.trace import OBJECT_COORDINATES, Trace
from core.types import ContactPhase

__all__ = ["csv_columns", "write_csv"]

ROWS_AT_ONCE = 1000

CONTACT_COLUMNS = {
    "slip": "slip",
    "slip_velocity": "slip_velocity",
    "phase": "phase",
    "normal_force": "normal_force",
    "tangential_force": "tangential_force",
}
JOINT_COLUMNS = {"torque": "joint_torque", "joint_position": "joint_position"}


def csv_columns(result: RunResult) -> list[str]:
    """Names of the columns, in order."""
    return [name for name, _ in _columns(result.trace)]


def write_csv(result: RunResult, stream: TextIO) -> None:
    """Writes a run as comma-separated values, SI units, with a header line.

    Every number has as many digits as it takes to read back the same bits. An event
    gives two rows with the same time: before and after.

    Args:
        result: The run.
        stream: Where the text goes.
    """
    names, arrays = zip(*_columns(result.trace), strict=True)
    stream.write(",".join(names) + "\n")
    for start in range(0, len(result.trace), ROWS_AT_ONCE):
        rows = slice(start, start + ROWS_AT_ONCE)
        columns = [_words(array[rows]) for array in arrays]
        stream.writelines(",".join(row) + "\n" for row in zip(*columns, strict=True))


def _columns(trace: Trace) -> Iterator[tuple[str, NDArray[np.float64] | NDArray[np.int8]]]:
    yield "t", trace.times
    yield from zip(OBJECT_COORDINATES, trace.object_pose.T, strict=True)
    for coordinate, errors in zip(OBJECT_COORDINATES, trace.tracking_error.T, strict=True):
        yield f"error_{coordinate}", errors
    for contact in range(trace.shape.num_contacts):
        for name, signal in CONTACT_COLUMNS.items():
            yield f"{name}_{contact}", getattr(trace, signal)[:, contact]
    num_joints = trace.joint_position.shape[1] // trace.shape.num_contacts
    for finger in range(trace.shape.num_contacts):
        for joint in range(num_joints):
            for name, signal in JOINT_COLUMNS.items():
                column = getattr(trace, signal)[:, finger * num_joints + joint]
                yield f"{name}_{finger}_{joint}", column
    for key, estimates in zip(trace.shape.unknowns, trace.estimates.T, strict=True):
        yield f"estimate_{key}", estimates


def _words(values: NDArray[np.float64] | NDArray[np.int8]) -> list[str]:
    """Phases as words, numbers with every digit."""
    if np.issubdtype(values.dtype, np.integer):
        return [_LABELS[value] for value in values.tolist()]
    return list(map(repr, values.tolist()))


_LABELS = {phase.value: phase.label for phase in ContactPhase}
