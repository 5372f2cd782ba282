"""Measured recordings as tables of other programs: CSV, Parquet, NPZ."""

from __future__ import annotations

import codecs
import json
from collections.abc import Callable
from typing import BinaryIO

import numpy as np

from slipgrasp.core.trace.signals import TIME_COLUMN
from slipgrasp.recordings.measured.recording import MeasuredRecording

ROWS_AT_ONCE = 1000


def write_measured_csv(recording: MeasuredRecording, stream: BinaryIO) -> None:
    """Writes comma-separated values, SI units; numbers read back to the same bits."""
    text = codecs.getwriter("utf-8")(stream)
    text.write(",".join(_units(recording)) + "\n")
    for start in range(0, len(recording.times), ROWS_AT_ONCE):
        part = slice(start, start + ROWS_AT_ONCE)
        rows = np.column_stack([recording.times[part], recording.values[part]]).tolist()
        text.write("".join(",".join(map(repr, row)) + "\n" for row in rows))


def write_measured_parquet(recording: MeasuredRecording, stream: BinaryIO) -> None:
    """Writes a Parquet table with the unit of each column."""
    import pyarrow
    from pyarrow import parquet

    columns = [recording.times, *recording.values.T]
    fields = [
        pyarrow.field(name, pyarrow.float64(), nullable=False, metadata={"unit": unit})
        for name, unit in _units(recording).items()
    ]
    schema = pyarrow.schema(fields)
    parquet.write_table(pyarrow.table([*map(pyarrow.array, columns)], schema=schema), stream)


def write_measured_npz(recording: MeasuredRecording, stream: BinaryIO) -> None:
    """Writes one array per column, and ``units.json`` with the unit of each."""
    units = _units(recording)
    columns = [recording.times, *recording.values.T]
    arrays = dict(zip(units, columns, strict=True))
    np.savez_compressed(stream, **{**arrays, "units.json": np.array(json.dumps(units))})


def _units(recording: MeasuredRecording) -> dict[str, str]:
    columns = recording.outline.columns
    return {TIME_COLUMN: "s", **{column.name: column.unit for column in columns}}


MEASURED_TABLES: dict[str, Callable[[MeasuredRecording, BinaryIO], None]] = {
    "csv": write_measured_csv,
    "parquet": write_measured_parquet,
    "npz": write_measured_npz,
}
"""The writers of measured recordings by the name of the export format."""
