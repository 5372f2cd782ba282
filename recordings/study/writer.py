"""Writes the file of a study: its definition, then one message per run.

The unfinished file is ``NAME.part``. Rows are written in chunks in the order of the runs, so that
an interrupted study continues after its last row. Partial chunks are rearranged at the end, so that
equal studies give equal files.
"""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from itertools import chain, islice
from pathlib import Path
from typing import Self

import numpy as np
from mcap.opcode import Opcode

from slipgrasp.core.run.provenance import program_version
from slipgrasp.core.study.definition import Study
from slipgrasp.recordings.exceptions import (
    RecordingBusyError,
    RecordingExistsError,
    RecordingWriteError,
)
from slipgrasp.recordings.file.atomic_file import atomic_file, open_locked, part_of, sync_folder
from slipgrasp.recordings.file.container import MESSAGE_HEAD, ChannelBlock, McapContainer
from slipgrasp.recordings.file.documents import STUDY_PROFILE
from slipgrasp.recordings.study.documents import (
    CHANNEL,
    DEFINITION,
    LAWS,
    STUDY_START,
    STUDY_STOP,
    StudyEnd,
    add_rows_topic,
    definition_document,
    start_document,
    stop_document,
)
from slipgrasp.recordings.study.reader import StudyReader, read_rows_so_far
from slipgrasp.recordings.study.study_row import RowsHash, StudyRow, decode_row, encode_row

RUNS_PER_CHUNK = 20
SYNC_INTERVAL = 1.0
REGULAR_SUFFIX = ".regular"

_OPCODE_AND_LENGTH = 9


class StudyWriter:
    """Writes one study; leaving its ``with`` block before `finish` retains the unfinished file.

    Args:
        path: The file to write, at first ``PATH.part``. If that exists for the same study, it is
            continued after its last complete chunk.
        study: The study.
        overwrite: Whether to replace an existing file.

    Attributes:
        num_runs: Number of runs of the study.
        num_rows: Number of written rows, which is also the index of the next run.
        outcomes: Number of rows by outcome.

    Raises:
        RecordingExistsError: If the file exists and may not be replaced.
        RecordingBusyError: If another process writes it, or ``.part`` belongs to another study.
        RecordingWriteError: If a file cannot be written.
    """

    def __init__(self, path: Path, study: Study, *, overwrite: bool = False) -> None:
        self._path = path
        self._part = part_of(path)
        self._study = study
        self._overwrite = overwrite
        self._hash = RowsHash()
        self._synced_at = time.monotonic()
        self._is_regular = True
        self.num_runs = study.num_runs
        self.num_rows = 0
        self.outcomes: Counter[str] = Counter()

    def __enter__(self) -> Self:
        if not self._overwrite and self._path.exists():
            raise RecordingExistsError(self._path)
        try:
            self._stream = open_locked(self._part, "another study is writing it")
            is_new = os.fstat(self._stream.fileno()).st_size == 0
            try:
                self._begin()
            except BaseException:
                self._stream.close()
                if is_new:
                    # An empty file would be mistaken for a study.
                    with suppress(OSError):
                        self._part.unlink()
                raise
        except OSError as error:
            raise self._failed(error) from error
        return self

    def __exit__(self, *_: object) -> None:
        # After a disk failure, errors of closing add no information.
        with suppress(OSError):
            self._stream.close()

    def add(self, rows: Sequence[StudyRow]) -> None:
        """Writes the next rows as a chunk.

        Args:
            rows: Rows in the order of their runs, up to the end of a chunk, which may be partial.

        Raises:
            RecordingWriteError: If they cannot be written.
        """
        try:
            self._add([encode_row(row) for row in rows])
            self.outcomes.update(row.outcome.value for row in rows)
            self._stream.flush()
            if time.monotonic() - self._synced_at >= SYNC_INTERVAL:
                os.fsync(self._stream.fileno())
                self._synced_at = time.monotonic()
        except OSError as error:
            raise self._failed(error) from error

    def ending(self, message: str = "") -> StudyEnd:
        """The end of the study with the rows so far: ``cancelled`` if some are missing.

        Args:
            message: Further message in a sentence.
        """
        return StudyEnd(
            state="completed" if self.num_rows == self.num_runs else "cancelled",
            runs=self.num_rows,
            outcomes=dict(sorted(self.outcomes.items())),
            message=message,
        )

    def finish(self, end: StudyEnd) -> None:
        """Writes the end of the study, and renames the file to its final name.

        Raises:
            RecordingWriteError: If a file cannot be written.
        """
        try:
            self._end(end)
            if os.name != "posix":
                self._stream.close()  # elsewhere only a closed file can be renamed
            # Without space for the rearranged file, the file can be read as it is.
            if self._is_regular or not self._lay_out_anew(end):
                self._part.replace(self._path)
            sync_folder(self._path.parent)
        except OSError as error:
            raise self._failed(error) from error

    def _end(self, end: StudyEnd) -> None:
        self._container.add_metadata(STUDY_STOP, stop_document(end, self._hash.hexdigest()))
        self._container.finish()
        self._stream.flush()
        os.fsync(self._stream.fileno())

    def _lay_out_anew(self, end: StudyEnd) -> bool:
        """Writes the rows in full chunks to a new file, which replaces the old one."""
        so_far = read_rows_so_far(self._part)
        assert so_far is not None
        try:
            with atomic_file(self._path, overwrite=True, part_suffix=REGULAR_SUFFIX) as stream:
                regular = StudyWriter(self._path, self._study)
                regular._stream = stream
                regular._write_head(so_far[0])
                payloads = chain.from_iterable(so_far[1])
                while chunk := list(islice(payloads, RUNS_PER_CHUNK)):
                    regular._add(chunk)
                regular._end(end)
        except (OSError, RecordingWriteError):
            return False
        self._part.unlink()
        return True

    def _begin(self) -> None:
        """Writes everything before the rows, and the existing rows.

        The existing content is rewritten unchanged, so that an interruption loses nothing.
        """
        known, chunks = read_rows_so_far(self._part) or (None, [])
        if known is not None and known.definition != definition_document(self._study):
            cause = f"'{self._part.name}' belongs to another study; delete or move it"
            raise RecordingBusyError(self._path, cause)
        if known is not None and known.start.get(LAWS) != start_document(self._study).get(LAWS):
            cause = (
                f"'{self._part.name}' was started with another version of its control law; delete "
                "it to start again, or restore the original version"
            )
            raise RecordingBusyError(self._path, cause)
        self._write_head(known)
        for payloads in chunks:
            self._add(payloads)
            self.outcomes.update(decode_row(payload).outcome.value for payload in payloads)
        self._stream.truncate()
        self._stream.flush()
        os.fsync(self._stream.fileno())
        sync_folder(self._part.parent)

    def _write_head(self, known: StudyReader | None) -> None:
        """Writes everything before the rows, unchanged if the study is continued."""
        definition = definition_document(self._study)
        start = start_document(self._study) if known is None else dict(known.start)
        library = f"slipgrasp {program_version()}" if known is None else known.library
        self._stream.seek(0)
        self._container = McapContainer(self._stream, profile=STUDY_PROFILE, library=library)
        self._container.add_metadata(STUDY_START, start)
        self._container.add_attachment(DEFINITION, "application/json", definition)
        add_rows_topic(self._container)

    def _add(self, payloads: Sequence[bytes]) -> None:
        self._is_regular &= self.num_rows % RUNS_PER_CHUNK == 0
        sequences = np.arange(self.num_rows, self.num_rows + len(payloads), dtype=np.uint64)
        records = [
            MESSAGE_HEAD.pack(
                Opcode.MESSAGE,
                MESSAGE_HEAD.size - _OPCODE_AND_LENGTH + len(payload),
                CHANNEL,
                number,
                number,
                number,
            )
            + payload
            for number, payload in zip(sequences.tolist(), payloads, strict=True)
        ]
        sizes = np.array([0, *map(len, records[:-1])], dtype=np.uint64)
        block = ChannelBlock(CHANNEL, sequences, np.cumsum(sizes, dtype=np.uint64))
        self._container.add_chunk(b"".join(records), [block])
        self.num_rows += len(payloads)
        for payload in payloads:
            self._hash.add(payload)

    def _failed(self, error: OSError) -> RecordingWriteError:
        return RecordingWriteError(self._path, error.strerror or type(error).__name__)
