"""Arguments that several commands share."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from recordings.store import RecordingStore

__all__ = ["add_data_directory", "data_directory", "names_a_file", "recording_path", "store_in"]


def add_data_directory(parser: argparse.ArgumentParser) -> None:
    """Adds ``--data-dir``."""
    parser.add_argument(
        "--data-dir",
        dest="data_directory",
        metavar="DIR",
        type=Path,
        help="folder of the recordings (default: SLIPGRASP_DATA, else the platform's data folder)",
    )


def data_directory(chosen: Path | None) -> Path:
    """The folder of the recordings: as chosen, else as the environment says."""
    from recordings.store import default_data_directory

    return default_data_directory() if chosen is None else chosen


def store_in(chosen: Path | None) -> RecordingStore:
    """The runs in the folder of the recordings."""
    from recordings.store import RecordingStore

    return RecordingStore(data_directory(chosen))


def recording_path(source: str, chosen: Path | None) -> Path:
    """The file of a recording that is named by its path, or by its id in the data folder.

    Args:
        source: The path or the id.
        chosen: The folder of the recordings, if one was chosen.

    Raises:
        RecordingNotFoundError: If there is no run of that id.
    """
    return Path(source) if names_a_file(source) else store_in(chosen).get(source).path


def names_a_file(source: str) -> bool:
    """Whether a recording is named by its path; anything that does not look so is an id."""
    path = Path(source)
    return bool(path.suffix) or path.parent != Path() or path.exists()
