"""State of the export of files."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.core.words.display_name import file_stem


@dataclass(frozen=True, slots=True)
class ExportFile:
    """A file for download."""

    name: str
    content: bytes


@dataclass(frozen=True, slots=True)
class Exporting:
    """State of the export.

    Attributes:
        number: Number of the export in the session.
        busy_with: Current activity; empty if there is none.
        share: Completed fraction, 0 to 1.
        message: Result of the last export.
        is_failure: Whether it failed.
        pictures: Number of requested images of the scene.
        picture_name: File name of the last image.
    """

    number: int = 0
    busy_with: str = ""
    share: float = 0.0
    message: str = ""
    is_failure: bool = False
    pictures: int = 0
    picture_name: str = ""


def file_name(run: str, what: str, ending: str) -> str:
    """A portable file name, such as ``slipgrasp-paper-case-2-charts.svg``.

    Args:
        run: Name of the run.
        what: Content of the file; may be empty.
        ending: Suffix, without the dot.
    """
    return "-".join(part for part in ("slipgrasp", file_stem(run), what) if part) + f".{ending}"
