"""Tables as text for the terminal."""

from __future__ import annotations

from collections.abc import Collection, Sequence


def table_lines(rows: Sequence[Sequence[str]], left: Collection[int] = (0,)) -> list[str]:
    """Lines of a table with aligned columns; none if it has only heads.

    Args:
        rows: Heads, and the rows below them.
        left: Indices of the columns that are aligned on the left; others on the right.
    """
    if len(rows) == 1:
        return []
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    forms = [f"{'<' if k in left else '>'}{width}" for k, width in enumerate(widths)]
    return ["  ".join(map(format, row, forms)).rstrip() for row in rows]
