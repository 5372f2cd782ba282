"""What a user takes away: the file that is being made, and what became of the last one."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.core.words.display_name import file_stem


@dataclass(frozen=True, slots=True)
class ExportFile:
    """A file for the user's disk."""

    name: str
    content: bytes


@dataclass(frozen=True, slots=True)
class Exporting:
    """How far the export has come.

    Attributes:
        number: Which export, counted from the start of the session.
        busy_with: What is being made, in words; empty if nothing is.
        share: How much of it is done, 0 to 1.
        message: What became of the last one, in words.
        is_failure: Whether that is bad news.
        pictures: How many pictures of the scene were asked for.
        picture_name: What the file of the last one is called.
    """

    number: int = 0
    busy_with: str = ""
    share: float = 0.0
    message: str = ""
    is_failure: bool = False
    pictures: int = 0
    picture_name: str = ""


def file_name(run: str, what: str, ending: str) -> str:
    """A name that every file system takes, such as ``slipgrasp-paper-case-2-charts.svg``.

    Args:
        run: What the run is called.
        what: What the file shows; may be empty.
        ending: Its ending, without the dot.
    """
    return "-".join(part for part in ("slipgrasp", file_stem(run), what) if part) + f".{ending}"
