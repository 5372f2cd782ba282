"""User settings of the charts; a part of them is a layout in links."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace

MOST_CHOSEN = 12
"""Largest number of selected signals."""
MOST_HIDDEN = 60
"""Largest number of hidden lines in a layout."""
MAX_LAYOUT = 6000
"""Longest layout [characters]."""


@dataclass(frozen=True, slots=True)
class ChartsView:
    """Hidden lines, selected signals, and the second cursor.

    Attributes:
        hidden: Key of the chart and key of the line.
        chosen: Names of the selected signals.
        across: Name of the signal on their horizontal axis; empty if there is none.
        mark: Time of the second cursor [s]; None if there is none.
        seen: Visible tabs, among those that are drawn only while visible.
    """

    hidden: frozenset[tuple[str, str]] = frozenset()
    chosen: tuple[str, ...] = ()
    across: str = ""
    mark: float | None = None
    seen: frozenset[str] = frozenset()

    def toggled(self, chart: str, line: str) -> ChartsView:
        """Hides a line, or shows it again."""
        return replace(self, hidden=self.hidden ^ {(chart, line)})

    def with_signal_toggled(self, name: str) -> ChartsView:
        """Adds a signal, or removes it."""
        kept = tuple(each for each in self.chosen if each != name)
        return replace(self, chosen=kept if name in self.chosen else (*kept, name))

    def with_tab_seen(self, tab: str, is_visible: bool) -> ChartsView:
        """Marks a tab as visible or invisible."""
        others = self.seen - {tab}
        return replace(self, seen=others | {tab} if is_visible else others)

    def hidden_in(self, chart: str) -> frozenset[str]:
        """Keys of the hidden lines of a chart."""
        return frozenset(line for key, line in self.hidden if key == chart)

    def layout(self) -> str:
        """The layout as JSON; empty for the default."""
        hidden = [list(pair) for pair in sorted(self.hidden)]
        parts = {"signals": list(self.chosen), "across": self.across, "hidden": hidden}
        kept = {name: part for name, part in parts.items() if part}
        return json.dumps(kept, separators=(",", ":"), ensure_ascii=False) if kept else ""

    def laid_out(self, layout: str) -> ChartsView:
        """Applies a layout, as far as it is valid; unknown signals are harmless."""
        try:
            read = json.loads(layout[:MAX_LAYOUT] or "{}")
        except (ValueError, RecursionError):
            return self
        parts = read if isinstance(read, dict) else {}
        across = parts.get("across", "")
        return replace(
            self,
            hidden=frozenset(_pairs(parts.get("hidden"))),
            chosen=tuple(dict.fromkeys(_names(parts.get("signals"))))[:MOST_CHOSEN],
            across=across if isinstance(across, str) else "",
        )


def _names(read: object) -> Iterator[str]:
    if isinstance(read, list):
        yield from (each for each in read if isinstance(each, str))


def _pairs(read: object) -> Iterator[tuple[str, str]]:
    for each in read[:MOST_HIDDEN] if isinstance(read, list) else ():
        match each:
            case [str(chart), str(line)]:
                yield chart, line


PLAIN = ChartsView()
"""The default settings."""
