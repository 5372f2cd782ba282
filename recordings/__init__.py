"""Runs as MCAP files: written, read back bit for bit, kept in a folder, exported as CSV."""

from slipgrasp.recordings.exceptions import (
    DamagedRecordingError,
    ForeignRecordingError,
    NewerRecordingError,
    RecordingError,
    RecordingExistsError,
    RecordingNotFoundError,
    RecordingWriteError,
)
from slipgrasp.recordings.export import csv_columns, write_csv
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.writer import RecordingWriter, write_recording
from slipgrasp.recordings.store.store import RecordingStore, StoredRun, default_data_directory

__all__ = [
    "DamagedRecordingError",
    "ForeignRecordingError",
    "NewerRecordingError",
    "RecordingError",
    "RecordingExistsError",
    "RecordingNotFoundError",
    "RecordingStore",
    "RecordingWriteError",
    "RecordingWriter",
    "StoredRun",
    "csv_columns",
    "default_data_directory",
    "read_recording",
    "write_csv",
    "write_recording",
]
