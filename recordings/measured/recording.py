"""Recordings of measured data and their files: one MCAP topic with a number per signal.

The file has the container, message layout and checksums of recorded runs, but a separate profile.
It has no scenario, because nothing is simulated.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from os import PathLike
from typing import Any

import numpy as np
from mcap.records import Header, McapRecord, Metadata, Schema
from numpy.typing import NDArray

from slipgrasp.core.run.provenance import program_version
from slipgrasp.core.trace.signals import TIME_COLUMN, Floats
from slipgrasp.recordings.exceptions import (
    DamagedRecordingError,
    ForeignRecordingError,
    NewerRecordingError,
)
from slipgrasp.recordings.file.container import ChannelBlock, McapContainer
from slipgrasp.recordings.file.documents import MEASURED_PROFILE, read_as
from slipgrasp.recordings.file.packing import MessageLayout, to_log_times
from slipgrasp.recordings.file.reader import open_recording
from slipgrasp.recordings.file.scan import ChannelMessages, RecordScanner
from slipgrasp.recordings.file.schemas import Field, Topic, file_descriptor_set

MEASURED_FORMAT = 1
MEASURED_START = "slipgrasp/measured/start"
MEASURED_STOP = "slipgrasp/measured/stop"
MEASURED_TOPIC = "/slipgrasp/measured"
ROWS_PER_CHUNK = 4096
MAX_GAPS = 1000
"""Largest number of listed gaps; beyond it, gaps are only counted."""

_CHANNEL = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredColumn:
    """A measured signal.

    Attributes:
        name: Name of the same column of a run, such as ``slip_0``.
        unit: SI unit.
        source: The original column of the table, with its unit.
    """

    name: str
    unit: str
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Sampling:
    """Times of the samples.

    Attributes:
        samples: Number of samples.
        start: Time of the first one [s].
        end: Time of the last one [s].
        period: Median time between samples [s].
        even: Whether all intervals except gaps are within 10 % of the period.
        num_gaps: Number of gaps: intervals longer than a limit.
        gaps: Start and end of each [s]; the first 1 000.
    """

    samples: int
    start: float
    end: float
    period: float
    even: bool
    num_gaps: int
    gaps: tuple[tuple[float, float], ...]

    @property
    def text(self) -> str:
        """Description of the sampling."""
        rate = f"at {1.0 / self.period:.6g} Hz" if self.even else "unevenly sampled"
        gaps = f", {self.num_gaps} gap{'s' if self.num_gaps != 1 else ''}" if self.num_gaps else ""
        return f"{self.samples} samples {rate} from {self.start:.6g} to {self.end:.6g} s{gaps}"


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredOutline:
    """A recording of measured data without its samples.

    Attributes:
        title: Title of the recording.
        columns: The signals.
        sampling: Times of the samples.
    """

    title: str
    columns: tuple[MeasuredColumn, ...]
    sampling: Sampling

    @property
    def text(self) -> str:
        """A sentence for lists."""
        names = ", ".join(column.name for column in self.columns)
        return f"{self.title}: measured {names}; {self.sampling.text}"

    def to_mapping(self) -> dict[str, Any]:
        """The outline as plain values for JSON (the ``import --json`` object)."""
        return {"kind": "measured", **asdict(self)}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasuredRecording:
    """Measured signals over time.

    Attributes:
        outline: Title, signals and sampling.
        times: Times of the samples, increasing, shape ``(samples,)`` [s].
        values: SI values, shape ``(samples, signals)``.
    """

    outline: MeasuredOutline
    times: Floats
    values: Floats

    def column(self, name: str) -> Floats:
        """The values of a signal.

        Raises:
            KeyError: If the signal was not measured.
        """
        names = [column.name for column in self.outline.columns]
        if name not in names:
            raise KeyError(name)
        return self.values[:, names.index(name)]


class MeasuredWriter:
    """Writes a recording of measured data block by block.

    Args:
        stream: Output stream.
        title: Title of the recording.
        columns: The signals.
    """

    def __init__(self, stream: Any, title: str, columns: Sequence[MeasuredColumn]) -> None:
        version = program_version()
        library = f"slipgrasp {version}"
        self._container = McapContainer(stream, profile=MEASURED_PROFILE, library=library)
        self._layout = _layout(columns)
        self._sequence = 0
        start = {
            "format": str(MEASURED_FORMAT),
            "program": version,
            "title": title,
            "columns": _json([asdict(column) for column in columns]),
        }
        self._container.add_metadata(MEASURED_START, start)
        topic = self._layout.topic
        data = file_descriptor_set(topic)
        schema = Schema(id=_CHANNEL, name=topic.schema_name, encoding="protobuf", data=data)
        texts = {field.name: field.text for field in topic.fields}
        self._container.add_topic(MEASURED_TOPIC, schema, texts)

    def write(self, times: Floats, values: Floats) -> None:
        """Appends samples: times ``(samples,)`` [s], SI values ``(samples, signals)``."""
        for start in range(0, len(times), ROWS_PER_CHUNK):
            part = slice(start, start + ROWS_PER_CHUNK)
            self._write_chunk(times[part], values[part])

    def _write_chunk(self, times: Floats, values: Floats) -> None:
        records = np.zeros(len(times), self._layout.record_type)
        names = [field.name for field in self._layout.topic.fields[1:]]
        columns = {"t": times, **dict(zip(names, values.T, strict=True))}
        self._layout.pack(records, columns, self._sequence)
        self._sequence += len(times)
        size = self._layout.record_type.itemsize
        offsets = np.arange(len(times), dtype=np.uint64) * size
        block = ChannelBlock(_CHANNEL, to_log_times(times), offsets)
        self._container.add_chunk(records.tobytes(), [block])

    def finish(self, sampling: Sampling) -> None:
        """Writes the sampling and the index."""
        self._container.add_metadata(MEASURED_STOP, {"sampling": _json(asdict(sampling))})
        self._container.finish()


def _layout(columns: Sequence[MeasuredColumn]) -> MessageLayout:
    fields = [Field("t", "double", False, "Time. [s]")]
    for column in columns:
        fields.append(Field(column.name, "double", False, f"From {column.source}. [{column.unit}]"))
    topic = Topic(MEASURED_TOPIC, "Measured", tuple(fields))
    return MessageLayout(topic, _CHANNEL, [1] * len(fields))


def is_measured(path: str | PathLike[str]) -> bool:
    """Whether a file is a recording of measured data; False for other and damaged files.

    Raises:
        RecordingError: If it is missing, or not an MCAP file.
    """
    with open_recording(path) as stream:
        header = next(RecordScanner(stream, str(path), lambda channel: False).records())
        return isinstance(header, Header) and header.profile == MEASURED_PROFILE


def read_measured(path: str | PathLike[str]) -> MeasuredRecording:
    """Reads a recording of measured data.

    Raises:
        RecordingError: If it is missing, damaged, or not a recording of measured data.
    """
    with _reading(path, with_samples=True) as reading:
        return reading.recording()


def read_outline(path: str | PathLike[str]) -> MeasuredOutline:
    """Reads title, signals and sampling of measured data, and skips the samples.

    Raises:
        RecordingError: If it is missing, damaged, or not a recording of measured data.
    """
    with _reading(path, with_samples=False) as reading:
        return reading.outline()


@contextmanager
def _reading(path: str | PathLike[str], *, with_samples: bool) -> Iterator[_Reading]:
    with open_recording(path) as stream:
        yield _Reading(
            str(path),
            RecordScanner(
                stream,
                str(path),
                lambda channel: channel == _CHANNEL and with_samples,
                is_ours=lambda channel: channel == _CHANNEL,
                is_needed=lambda chunk: with_samples,
            ),
        )


class _Reading:
    """One pass through a file."""

    def __init__(self, name: str, scanner: RecordScanner) -> None:
        self._name = name
        self._metadata: dict[str, dict[str, str]] = {}
        self._columns: tuple[MeasuredColumn, ...] = ()
        self._layout: MessageLayout | None = None
        self._blocks: list[dict[str, NDArray[Any]]] = []
        records = scanner.records()
        header = next(records)
        if not isinstance(header, Header) or header.profile != MEASURED_PROFILE:
            raise ForeignRecordingError(name, "it contains no measured data")
        for record in records:
            self._take(record)

    def _take(self, record: McapRecord | ChannelMessages) -> None:
        if isinstance(record, Metadata):
            self._metadata[record.name] = record.metadata
            if record.name == MEASURED_START:
                self._take_start(record.metadata)
        elif isinstance(record, ChannelMessages):
            if self._layout is None:
                raise self._damaged("its signals are not described")
            try:
                self._blocks.append(self._layout.unpack(record.payloads))
            except ValueError as error:
                raise self._damaged(str(error)) from error

    def _take_start(self, start: dict[str, str]) -> None:
        try:
            version = int(start["format"])
            if version > MEASURED_FORMAT:
                raise NewerRecordingError(self._name, version, MEASURED_FORMAT)
            self._columns = read_as(tuple[MeasuredColumn, ...], start["columns"])
        except (KeyError, ValueError) as error:
            raise self._damaged("its start document is malformed") from error
        self._layout = _layout(self._columns)

    def outline(self) -> MeasuredOutline:
        """Title, signals and sampling."""
        try:
            sampling = read_as(Sampling, self._metadata[MEASURED_STOP]["sampling"])
            title = self._metadata[MEASURED_START]["title"]
        except (KeyError, ValueError) as error:
            raise self._damaged("its end document is malformed") from error
        return MeasuredOutline(title=title, columns=self._columns, sampling=sampling)

    def recording(self) -> MeasuredRecording:
        """The complete recording."""
        outline = self.outline()
        names = [TIME_COLUMN, *(column.name for column in outline.columns)]
        empty: list[Any] = [np.empty(0)]
        parts = [np.concatenate([b[name] for b in self._blocks] or empty) for name in names]
        if len(parts[0]) != outline.sampling.samples or not np.isfinite(parts).all():
            raise self._damaged("its number of samples differs from its statement")
        if not (np.diff(parts[0]) > 0.0).all():
            raise self._damaged("its times do not increase")
        return MeasuredRecording(outline=outline, times=parts[0], values=np.stack(parts[1:], 1))

    def _damaged(self, finding: str) -> DamagedRecordingError:
        return DamagedRecordingError(self._name, finding)


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
