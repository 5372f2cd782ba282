"""The fenced blocks of a page: code, and what the page says that it prints."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path
from typing import Any, NamedTuple

DOCS = Path(__file__).parents[1] / "docs"
_BLOCK = re.compile(r"^```(\w+)(?: file=(\S+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)


class Block(NamedTuple):
    """A fenced block.

    Attributes:
        kind: The word behind its fence, such as ``python``.
        file: Name of the file that it is; empty if it is none.
        text: What it holds.
        printed: The block of output below it; None if there is none.
    """

    kind: str
    file: str
    text: str
    printed: str | None


def blocks_of(page: str, *kinds: str) -> list[Block]:
    """The blocks of some kinds, or all, in the order of a page."""
    found = _BLOCK.findall(page)
    following = [*found[1:], ("", "", "")]
    return [
        Block(kind, file, text, output if next_kind == "text" else None)
        for (kind, file, text), (next_kind, _, output) in zip(found, following, strict=True)
        if not kinds or kind in kinds
    ]


def output_of(code: str, names: dict[str, Any]) -> str:
    """Executes code of a page.

    Args:
        code: Python.
        names: Its global names, which are kept for the next piece.

    Returns:
        What it prints.
    """
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        exec(compile(code, "page.md", "exec"), names)
    return printed.getvalue()
