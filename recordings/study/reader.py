"""Reads the file of a study, row by row, even while it is being written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from mcap.records import Attachment, Channel, Header, McapRecord, Metadata

from slipgrasp.core.study.definition import Study
from slipgrasp.recordings.exceptions import (
    AlteredRecordingError,
    DamagedRecordingError,
    ForeignRecordingError,
    NewerRecordingError,
    RecordingError,
)
from slipgrasp.recordings.file.documents import STUDY_PROFILE
from slipgrasp.recordings.file.scan import ChannelMessages, RecordScanner
from slipgrasp.recordings.study.documents import (
    DEFINITION,
    STUDY_FORMAT,
    STUDY_START,
    STUDY_STOP,
    TOPIC,
    StudyEnd,
    read_definition,
    read_end,
)
from slipgrasp.recordings.study.study_row import RowsHash, StudyRow, decode_row

MAX_RECORD_BYTES = 1 << 25


class NoSuchRunError(RecordingError):
    """A study has no result of this run, or not yet."""

    def __init__(self, name: str, index: int, count: int) -> None:
        super().__init__(f"there is no run {index} in '{name}'; it has {count}, counted from 0")


class StudyReader:
    """One pass through the file of a study; see `open_study`.

    Attributes:
        study: The study.
        library: Program that wrote the file.
        start: Its start document.
        definition: Its definition document.
        end: End of the study; None before all rows are read, or if the file is unfinished.
    """

    def __init__(self, stream: BinaryIO, name: str, *, unfinished: bool) -> None:
        self._name = name
        self._unfinished = unfinished
        self._channels: set[int] = set()
        self._records = RecordScanner(
            stream,
            name,
            self._channels.__contains__,
            unfinished=unfinished,
            max_record_bytes=MAX_RECORD_BYTES,
        ).records()
        self._hash = RowsHash()
        self.end: StudyEnd | None = None
        self.start: Mapping[str, str] = {}
        self.definition = b""
        self.library = self._read_header(next(self._records))
        self._read_head()
        self.study = self._read_study()

    def rows(self) -> Iterator[StudyRow]:
        """Yields the rows in the order of the runs.

        Raises:
            DamagedRecordingError: If the file is incomplete or changed; for an unfinished one, the
                valid part is returned first.
        """
        for payloads in self.chunks():
            for payload in payloads:
                yield self._decode(payload)

    def row(self, index: int) -> StudyRow:
        """Returns the row of one run; the reader cannot be used afterwards.

        Raises:
            NoSuchRunError: If there is no such row.
            DamagedRecordingError: If the file is incomplete or changed up to there.
        """
        count = 0
        for payloads in self.chunks():
            if 0 <= index < count + len(payloads):
                return self._decode(payloads[index - count])
            count += len(payloads)
        raise NoSuchRunError(self._name, index, count)

    def chunks(self) -> Iterator[list[bytes]]:
        """Yields the encoded rows, chunk by chunk; raises the same errors as `rows`."""
        count = 0
        try:
            for record in self._records:
                if isinstance(record, ChannelMessages):
                    numbers = list(range(count, count + len(record.payloads)))
                    if record.sequences != numbers:
                        raise self._damaged("rows are missing or out of order")
                    count += len(numbers)
                    for payload in record.payloads:
                        self._hash.add(payload)
                    yield record.payloads
                elif isinstance(record, Metadata) and record.name == STUDY_STOP:
                    self.end = self._read_end(record.metadata, count)
        except DamagedRecordingError:
            if not self._unfinished:
                raise
        if self.end is None and not self._unfinished:
            raise self._damaged("its end document is missing")

    def _decode(self, payload: bytes) -> StudyRow:
        try:
            return decode_row(payload)
        except ValueError as error:
            raise self._damaged(str(error)) from error

    def _read_header(self, header: McapRecord | ChannelMessages) -> str:
        if not isinstance(header, Header):
            raise self._damaged("it does not start with a header")
        if header.profile != STUDY_PROFILE:
            finding = f"its profile is {header.profile[:40]!r}, not that of a study"
            raise ForeignRecordingError(self._name, finding)
        return header.library

    def _read_head(self) -> None:
        """Reads everything before the channel of the rows."""
        for record in self._records:
            match record:
                case Metadata(name=name) if name == STUDY_START:
                    self.start = record.metadata
                    self._check_format()
                case Attachment(name=name) if name == DEFINITION:
                    self.definition = record.data
                case Channel(topic=topic) if topic == TOPIC:
                    self._channels.add(record.id)
                    return
                case _:
                    continue
        raise self._damaged("it contains no rows")

    def _check_format(self) -> None:
        try:
            version = int(self.start["format"])
        except (KeyError, ValueError) as error:
            raise self._damaged("its start document is malformed") from error
        if version > STUDY_FORMAT:
            raise NewerRecordingError(self._name, version, STUDY_FORMAT)

    def _read_study(self) -> Study:
        try:
            return read_definition(self.definition, self.start)
        except ValueError as error:
            raise self._damaged(f"its definition is not valid: {error}") from error

    def _read_end(self, document: Mapping[str, str], count: int) -> StudyEnd:
        try:
            end = read_end(document)
        except (KeyError, ValueError) as error:
            raise self._damaged("its end document is malformed") from error
        if end.runs != count:
            raise self._damaged("its number of rows differs from the number written")
        if document.get("rows_hash") != self._hash.hexdigest():
            raise AlteredRecordingError(self._name)
        return end

    def _damaged(self, finding: str) -> DamagedRecordingError:
        return DamagedRecordingError(self._name, finding)


@contextmanager
def open_study(path: Path) -> Iterator[StudyReader]:
    """Opens the file of a study; a ``.part`` file may be incomplete.

    Raises:
        RecordingError: If it does not exist, is damaged or from another program.
    """
    unfinished = path.suffix == ".part"
    try:
        with path.open("rb") as stream:
            yield StudyReader(stream, str(path), unfinished=unfinished)
    except FileNotFoundError:
        raise RecordingError(f"there is no study '{path}'") from None
    except OSError as error:
        raise RecordingError(f"cannot read '{path}': {error.strerror}") from error


def read_rows_so_far(part: Path) -> tuple[StudyReader, list[list[bytes]]] | None:
    """Reads an unfinished file up to its first damaged byte.

    Returns:
        The documents at its start, and its encoded rows, chunk by chunk; None if its start is
        missing.

    Raises:
        RecordingError: If it cannot be read, or is not an unfinished study.
    """
    if part.stat().st_size == 0:
        return None
    try:
        with open_study(part) as reader:
            return reader, list(reader.chunks())
    except DamagedRecordingError:
        return None
