"""A run as NumPy arrays in one file, which `numpy.load` opens without unpickling anything."""

from __future__ import annotations

import json
import zipfile
from dataclasses import asdict
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.recordings.file.documents import scenario_document

SCENARIO = "scenario.json"
ENDING = "ending.json"
UNITS = "units.json"
PROVENANCE = "provenance.json"

# Files in an archive carry a date; a fixed one makes equal runs equal files.
_DATE = (1980, 1, 1, 0, 0, 0)


def write_npz(result: RunResult, stream: BinaryIO) -> None:
    """Writes a run as an NPZ file.

    It holds one array per column (`slipgrasp.core.trace.columns`; phases as the numbers -1, 0, 1),
    and as arrays of one text each, in JSON: ``scenario.json``, ``ending.json`` (outcome, reason,
    phase changes, estimates, metrics and warnings), ``units.json`` (column to unit) and
    ``provenance.json``.

    Args:
        result: The run.
        stream: Where the file goes; it must be seekable.
    """
    columns = columns_of(result.trace)
    arrays: dict[str, NDArray[Any]] = {column.name: column.values for column in columns}
    units = {column.name: column.unit for column in columns}
    arrays[SCENARIO] = np.array(scenario_document(result.scenario).decode())
    arrays[ENDING] = np.array(_json(result.summary()))
    arrays[UNITS] = np.array(_json(units))
    arrays[PROVENANCE] = np.array(_json(asdict(result.provenance)))
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            entry = zipfile.ZipInfo(f"{name}.npy", _DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(entry, "w", force_zip64=True) as file:
                npy.write_array(file, np.ascontiguousarray(array), allow_pickle=False)


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
