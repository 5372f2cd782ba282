"""Runs as MCAP files: written, read back bit for bit, kept in a folder, exported as CSV."""

from recordings.exceptions import (
    DamagedRecordingError,
    ForeignRecordingError,
    NewerRecordingError,
    RecordingError,
    RecordingExistsError,
    RecordingNotFoundError,
    RecordingWriteError,
)
from recordings.export import csv_columns, write_csv
from recordings.reader import read_recording
from recordings.store import RecordingStore, StoredRun, default_data_directory
from recordings.writer import RecordingWriter, write_recording

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
