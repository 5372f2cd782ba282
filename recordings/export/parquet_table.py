"""A run as a Parquet table: one column per number, its unit with it, the scenario in the file."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, BinaryIO

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.columns import Column, columns_of
from slipgrasp.recordings.file.documents import scenario_document

if TYPE_CHECKING:
    import pyarrow


def write_parquet(result: RunResult, stream: BinaryIO) -> None:
    """Writes a run as a Parquet file.

    Each column (`slipgrasp.core.trace.columns`) has its SI unit as ``unit`` in the metadata of its
    field; phases are words, as a dictionary. The metadata of the table holds in JSON
    ``slipgrasp.scenario``, ``slipgrasp.ending`` (outcome, reason, phase changes, estimates, metrics
    and warnings) and ``slipgrasp.provenance``.

    Args:
        result: The run.
        stream: Where the file goes.
    """
    import pyarrow
    from pyarrow import parquet

    columns = columns_of(result.trace)
    arrays = [_array(column) for column in columns]
    fields = [
        pyarrow.field(column.name, array.type, nullable=False, metadata={"unit": column.unit})
        for column, array in zip(columns, arrays, strict=True)
    ]
    schema = pyarrow.schema(fields, metadata=_documents(result))
    parquet.write_table(pyarrow.Table.from_arrays(arrays, schema=schema), stream)


def _array(column: Column) -> pyarrow.Array:
    import pyarrow

    if column.holds_phases:
        return pyarrow.array(column.phase_labels()).dictionary_encode()
    return pyarrow.array(column.values)


def _documents(result: RunResult) -> dict[str, Any]:
    return {
        "slipgrasp.scenario": scenario_document(result.scenario),
        "slipgrasp.ending": json.dumps(result.summary(), ensure_ascii=False, allow_nan=False),
        "slipgrasp.provenance": json.dumps(asdict(result.provenance)),
    }
