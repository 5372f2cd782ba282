"""Writes figures to files: equal runs give equal bytes, and other files are not replaced."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

from matplotlib.figure import Figure

from slipgrasp.figures.style import paper_style
from slipgrasp.recordings.exceptions import RecordingExistsError, RecordingWriteError
from slipgrasp.recordings.file.atomic_file import atomic_file

FORMATS = ("svg", "pdf", "png")

_MARK = "slipgrasp figures"

# Dates and versions of libraries would make equal runs differ.
_METADATA: dict[str, dict[str, Any]] = {
    "svg": {"Creator": _MARK, "Date": None},
    "pdf": {"Creator": _MARK, "Producer": None, "CreationDate": None},
    "png": {"Software": _MARK},
}


def check_folder(
    folder: Path, names: Iterable[str], formats: Sequence[str], *, overwrite: bool
) -> None:
    """Creates the folder, and checks whether all figures can be written to it.

    Args:
        folder: Folder of the figures.
        names: Their names, without suffixes.
        formats: Their suffixes, from `FORMATS`.
        overwrite: Whether to replace files that this program did not draw.

    Raises:
        RecordingWriteError: If the folder cannot be created or written.
        RecordingExistsError: If another file exists; earlier figures of this program are replaced.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise RecordingWriteError(folder, "it is a file, not a folder") from None
    except OSError as error:
        raise RecordingWriteError(folder, error.strerror or type(error).__name__) from error
    if not os.access(folder, os.W_OK | os.X_OK):
        raise RecordingWriteError(folder, "no permission to write in that folder")
    if overwrite:
        return
    for path in _paths(folder, names, formats):
        if path.exists() and not _is_our_own(path):
            raise RecordingExistsError(path)


def write_figures(
    figures: Mapping[str, Figure],
    folder: Path,
    formats: Sequence[str] = FORMATS,
    *,
    overwrite: bool = False,
) -> tuple[Path, ...]:
    """Saves figures, each in every format; earlier figures of this program are replaced.

    Args:
        figures: Figures to save, by name.
        folder: Folder, created if missing.
        formats: Suffixes from `FORMATS`.
        overwrite: Whether to replace files that this program did not draw.

    Returns:
        The files, in order.

    Raises:
        RecordingWriteError: If the disk or its permissions do not allow it.
        RecordingExistsError: If another file exists.
    """
    check_folder(folder, figures, formats, overwrite=overwrite)
    for name, figure in figures.items():
        for ending in formats:
            write_figure(figure, folder / f"{name}.{ending}", overwrite=True)
    return _paths(folder, figures, formats)


def write_figure(figure: Figure, path: Path, *, overwrite: bool = False) -> None:
    """Saves one figure in the format of the file suffix.

    Args:
        figure: Figure to save.
        path: File with a suffix from `FORMATS`.
        overwrite: Whether to replace an existing file.

    Raises:
        RecordingWriteError: If the disk or its permissions do not allow it.
        RecordingExistsError: If the file exists.
    """
    with atomic_file(path, overwrite=overwrite) as stream:
        save_figure(figure, stream, path.suffix.lower().removeprefix("."))


def save_figure(figure: Figure, stream: BinaryIO, ending: str) -> None:
    """Writes a figure to a stream in one of `FORMATS`, in the common style."""
    with paper_style():
        figure.savefig(stream, format=ending, metadata=_METADATA[ending])


def _paths(folder: Path, names: Iterable[str], formats: Sequence[str]) -> tuple[Path, ...]:
    return tuple(folder / f"{name}.{ending}" for name in names for ending in formats)


def _is_our_own(path: Path) -> bool:
    """Whether this program drew the file, according to its metadata."""
    return path.is_file() and _MARK.encode() in path.read_bytes()
