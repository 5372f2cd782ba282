"""Data with which a page reads recordings of its hand: layouts of the messages."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.columns import Column, columns_of
from slipgrasp.recordings.file.chunks import layouts_of
from slipgrasp.recordings.file.documents import SCENARIO_ATTACHMENT, START, STOP
from slipgrasp.recordings.file.packing import MessageLayout
from slipgrasp.recordings.file.scan import MAX_CHUNK_BYTES
from slipgrasp.recordings.file.schemas import PHASE_CHANGES, SAMPLE_TOPICS, format_of

_CHANGES = ("t", "contact", "from_phase", "to_phase")


def recording_data(result: RunResult, columns: dict[str, list[int]]) -> dict[str, Any]:
    """Layouts of the messages of recordings like this one, and its scenario, as plain values.

    Args:
        result: The run.
        columns: First column and number of columns of each signal.
    """
    shape = result.trace.shape
    version = format_of(shape)
    samples = {topic.name for topic in SAMPLE_TOPICS}
    topics = []
    for topic, layout in layouts_of(shape, version).items():
        if topic.name in samples:
            topics.append(_topic(layout, {"t": columns["times"], **columns}))
        elif topic.name == PHASE_CHANGES.name:
            topics.append(_topic(layout, {name: [k, 1] for k, name in enumerate(_CHANGES)}))
    return {
        "documents": {"start": START, "stop": STOP, "scenario": SCENARIO_ATTACHMENT},
        "format": str(version),
        "kernel": result.provenance.kernel,
        "topics": topics,
        "changes": PHASE_CHANGES.name,
        "names": [_named(column) for column in columns_of(result.trace)],
        "changeNames": _CHANGES,
        "scenario": result.scenario.to_mapping(),
        "mostChunkBytes": MAX_CHUNK_BYTES,
    }


def _named(column: Column) -> str:
    """A column with its signal."""
    own = column.name.startswith(column.signal)
    return column.name if own else f"{column.signal} ({column.name})"


def _topic(layout: MessageLayout, columns: dict[str, list[int]]) -> dict[str, Any]:
    return {
        "channel": layout.channel,
        "name": layout.topic.name,
        "bytes": layout.payload_type.itemsize,
        "fields": list(_fields(layout, columns)),
    }


def _fields(layout: MessageLayout, columns: dict[str, list[int]]) -> Iterator[list[Any]]:
    """Offset, protobuf type, first column and number of columns of each field with numbers."""
    described = layout.payload_type.fields or {}
    offsets: dict[str, int] = {name: offset for name, (_, offset, *_) in described.items()}
    for field in layout.topic.fields:
        first, width = columns[field.name]
        if width > 0:
            yield [offsets[field.name], field.kind, first, width]
