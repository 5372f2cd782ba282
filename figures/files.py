"""Figures as files: equal runs give equal bytes, and nobody else's file is replaced unasked."""

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
    """Makes the folder, and finds out whether all figures can be written into it.

    Args:
        folder: Where the figures go.
        names: Their names, without the endings.
        formats: Their endings, of `FORMATS`.
        overwrite: Whether files that this program did not draw may be replaced.

    Raises:
        RecordingWriteError: If the folder cannot be made or written to.
        RecordingExistsError: If a file is in the way; earlier figures of this program are not.
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
        figures: What to save, by name.
        folder: Where; made if it is not there.
        formats: Endings, of `FORMATS`.
        overwrite: Whether files that this program did not draw may be replaced.

    Returns:
        The files, in order.

    Raises:
        RecordingWriteError: If the disk or its permissions do not allow it.
        RecordingExistsError: If a file is in the way.
    """
    check_folder(folder, figures, formats, overwrite=overwrite)
    for name, figure in figures.items():
        for ending in formats:
            write_figure(figure, folder / f"{name}.{ending}", overwrite=True)
    return _paths(folder, figures, formats)


def write_figure(figure: Figure, path: Path, *, overwrite: bool = False) -> None:
    """Saves one figure, in the format that the name of its file ends with.

    Args:
        figure: What to save.
        path: Where, ending with one of `FORMATS`.
        overwrite: Whether an existing file is replaced.

    Raises:
        RecordingWriteError: If the disk or its permissions do not allow it.
        RecordingExistsError: If the file is there.
    """
    with atomic_file(path, overwrite=overwrite) as stream:
        save_figure(figure, stream, path.suffix.lower().removeprefix("."))


def save_figure(figure: Figure, stream: BinaryIO, ending: str) -> None:
    """Writes a figure to a stream, in one of `FORMATS`, in the style of all figures."""
    with paper_style():
        figure.savefig(stream, format=ending, metadata=_METADATA[ending])


def _paths(folder: Path, names: Iterable[str], formats: Sequence[str]) -> tuple[Path, ...]:
    return tuple(folder / f"{name}.{ending}" for name in names for ending in formats)


def _is_our_own(path: Path) -> bool:
    """Whether this program drew the file: it says so in its metadata."""
    return path.is_file() and _MARK.encode() in path.read_bytes()
