"""From a recording back to the run, bit for bit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from mcap.records import Attachment, Channel, Header, Metadata
from numpy.typing import NDArray

from core.result import RunResult
from core.scenario import Scenario
from core.trace import Trace, TraceShape
from core.types import ContactPhase, PhaseChange
from recordings.documents import (
    PROFILE,
    SCENARIO_ATTACHMENT,
    START,
    STOP,
    Ending,
    read_scenario,
    read_shape,
    read_stop,
)
from recordings.exceptions import (
    DamagedRecordingError,
    ForeignRecordingError,
    NewerRecordingError,
    RecordingError,
    RecordingNotFoundError,
)
from recordings.packing import MessageLayout, to_log_times
from recordings.scan import ChannelMessages, RecordScanner
from recordings.schemas import PHASE_CHANGES, SAMPLE_TOPICS, TIME_SIGNAL
from recordings.versions import FORMAT_VERSION
from recordings.writer import layouts_of

__all__ = ["read_recording"]

Columns = dict[str, NDArray[Any]]


def read_recording(path: Path) -> RunResult:
    """Reads a recording back into the run it was written from.

    Args:
        path: The MCAP file.

    Returns:
        The run: scenario, trace (bit for bit), phase changes, outcome, reason, warnings
        and metrics.

    Raises:
        RecordingNotFoundError: If there is no such file.
        ForeignRecordingError: If this program did not write it.
        NewerRecordingError: If a newer version of this program wrote it.
        DamagedRecordingError: If it is not complete and unchanged.
        RecordingError: If it cannot be opened.
    """
    try:
        with path.open("rb") as stream:
            return _Reading(stream, str(path)).run()
    except FileNotFoundError:
        raise RecordingNotFoundError(str(path)) from None
    except OSError as error:
        raise RecordingError(f"cannot read '{path}': {error.strerror}") from error


@dataclass(slots=True)
class _TopicColumns:
    """What was read of one topic so far."""

    layout: MessageLayout
    count: int = 0
    blocks: list[Columns] = field(default_factory=list)

    def joined(self) -> Columns:
        """All messages so far as one array per field."""
        return {
            name: np.concatenate([block[name] for block in self.blocks]) for name in self.blocks[0]
        }


class _Reading:
    """One pass through one file."""

    def __init__(self, stream: BinaryIO, name: str) -> None:
        self._name = name
        self._records = RecordScanner(stream, name).records()
        self._metadata: dict[str, Mapping[str, str]] = {}
        self._attachments: dict[str, bytes] = {}
        self._shape: TraceShape | None = None
        self._topics: dict[str, _TopicColumns] = {}
        self._channels: dict[int, _TopicColumns] = {}

    def run(self) -> RunResult:
        """Reads the file to its end and builds the run."""
        self._check_header(next(self._records))
        for record in self._records:
            match record:
                case ChannelMessages():
                    self._take_messages(record)
                case Channel():
                    self._take_channel(record)
                case Attachment():
                    self._attachments[record.name] = record.data
                case Metadata():
                    self._metadata[record.name] = record.metadata
                    if record.name == START:
                        self._take_start(record.metadata)
        return self._result()

    def _check_header(self, header: object) -> None:
        if not isinstance(header, Header):
            raise self._damaged("it does not start with a header")
        if header.profile != PROFILE:
            finding = f"it is an MCAP file of another program ({header.library[:40]!r})"
            raise ForeignRecordingError(self._name, finding)

    def _take_start(self, start: Mapping[str, str]) -> None:
        try:
            version = int(start["format"])
            if version > FORMAT_VERSION:
                raise NewerRecordingError(self._name, version, FORMAT_VERSION)
            self._shape = read_shape(start)
        except (KeyError, ValueError) as error:
            raise self._damaged("its start document is malformed") from error
        for topic, layout in layouts_of(self._shape).items():
            self._topics[topic.name] = _TopicColumns(layout, blocks=[layout.unpack([])])

    def _take_channel(self, channel: Channel) -> None:
        """Channels of topics that another program added are left alone."""
        columns = self._topics.get(channel.topic)
        if columns is not None:
            self._channels[channel.id] = columns

    def _take_messages(self, messages: ChannelMessages) -> None:
        columns = self._channels.get(messages.channel)
        if columns is None:
            return
        topic = columns.layout.topic.name
        try:
            block = columns.layout.unpack(messages.payloads)
        except ValueError as error:
            raise self._damaged(f"{error} ({topic})") from error
        if not np.array_equal(to_log_times(block["t"]), messages.log_times):
            raise self._damaged(f"times of {topic} contradict each other")
        count = columns.count + len(messages.sequences)
        if messages.sequences != list(range(columns.count, count)):
            raise self._damaged(f"messages of {topic} are missing or out of order")
        columns.count = count
        columns.blocks.append(block)

    def _result(self) -> RunResult:
        stop = self._metadata.get(STOP)
        if self._shape is None or stop is None:
            raise self._damaged("how the run began or ended is missing")
        ending = self._ending(stop)
        if ending.counts != {name: columns.count for name, columns in self._topics.items()}:
            raise self._damaged("it does not hold as many messages as were written")
        return RunResult(
            scenario=self._scenario(self._shape),
            trace=self._trace(self._shape),
            phase_changes=self._phase_changes(self._shape),
            outcome=ending.outcome,
            reason=ending.reason,
            warnings=ending.warnings,
            metrics=ending.metrics,
        )

    def _ending(self, stop: Mapping[str, str]) -> Ending:
        try:
            return read_stop(stop)
        except (KeyError, TypeError, ValueError) as error:
            raise self._damaged("how the run ended is malformed") from error

    def _scenario(self, shape: TraceShape) -> Scenario:
        document = self._attachments.get(SCENARIO_ATTACHMENT)
        if document is None:
            raise self._damaged("its scenario is missing")
        try:
            scenario = read_scenario(document)
        except ValueError as error:
            raise self._damaged(f"its scenario is not valid: {error}") from error
        unknowns = tuple(estimate.parameter for estimate in scenario.estimates)
        if shape != TraceShape(len(scenario.fingers), unknowns):
            raise self._damaged("its scenario does not belong to its samples")
        return scenario

    def _trace(self, shape: TraceShape) -> Trace:
        arrays: Columns = {}
        for topic in SAMPLE_TOPICS:
            columns = self._topics[topic.name].joined()
            times = columns.pop("t")
            first = arrays.setdefault(TIME_SIGNAL.name, times)
            if not np.array_equal(times, first):
                raise self._damaged(f"the samples of {topic.name} lie at other times")
            arrays |= columns
        if (np.abs(arrays["phase"]) > 1).any() or (np.abs(arrays["believed_phase"]) > 1).any():
            raise self._damaged("it holds a phase that does not exist")
        return Trace(shape=shape, **arrays)

    def _phase_changes(self, shape: TraceShape) -> tuple[PhaseChange, ...]:
        columns = self._topics[PHASE_CHANGES.name].joined()
        if (columns["contact"] >= shape.num_contacts).any():
            raise self._damaged("it holds a phase change of a contact that does not exist")
        rows = zip(*(columns[field.name].tolist() for field in PHASE_CHANGES.fields), strict=True)
        try:
            return tuple(
                PhaseChange(
                    time=time,
                    contact=contact,
                    from_phase=ContactPhase(from_phase),
                    to_phase=ContactPhase(to_phase),
                )
                for time, contact, from_phase, to_phase in rows
            )
        except ValueError as error:
            raise self._damaged("it holds a phase that does not exist") from error

    def _damaged(self, finding: str) -> DamagedRecordingError:
        return DamagedRecordingError(self._name, finding)
