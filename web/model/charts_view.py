"""What a user has made of the charts; a part of it is a layout that a link can carry."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace

MOST_CHOSEN = 12
"""Most signals that may have charts of the user's choice."""
MOST_HIDDEN = 60
"""Most lines that a layout may hide."""
MAX_LAYOUT = 6000
"""Longest layout [characters]."""


@dataclass(frozen=True, slots=True)
class ChartsView:
    """Which lines are hidden, which signals were added, and where the second cursor stands.

    Attributes:
        hidden: Each as the key of its chart and its own key.
        chosen: Names of signals that have charts of the user's choice.
        across: Name of the signal that these are drawn against, too; empty if none.
        mark: Where the second cursor stands [s]; None if there is none.
        seen: Tabs that are in sight, of those that are drawn only then.
    """

    hidden: frozenset[tuple[str, str]] = frozenset()
    chosen: tuple[str, ...] = ()
    across: str = ""
    mark: float | None = None
    seen: frozenset[str] = frozenset()

    def toggled(self, chart: str, line: str) -> ChartsView:
        """With one line hidden, or back."""
        return replace(self, hidden=self.hidden ^ {(chart, line)})

    def with_signal_toggled(self, name: str) -> ChartsView:
        """With a signal added, or taken out again."""
        kept = tuple(each for each in self.chosen if each != name)
        return replace(self, chosen=kept if name in self.chosen else (*kept, name))

    def with_tab_seen(self, tab: str, is_visible: bool) -> ChartsView:
        """With a tab in sight, or out of it."""
        others = self.seen - {tab}
        return replace(self, seen=others | {tab} if is_visible else others)

    def hidden_in(self, chart: str) -> frozenset[str]:
        """Keys of the lines that are hidden in a chart."""
        return frozenset(line for key, line in self.hidden if key == chart)

    def layout(self) -> str:
        """What is worth keeping, as JSON; empty while it is as at first."""
        hidden = [list(pair) for pair in sorted(self.hidden)]
        parts = {"signals": list(self.chosen), "across": self.across, "hidden": hidden}
        kept = {name: part for name, part in parts.items() if part}
        return json.dumps(kept, separators=(",", ":"), ensure_ascii=False) if kept else ""

    def laid_out(self, layout: str) -> ChartsView:
        """With a layout, as far as it can be read; a signal that no run has does no harm."""
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
"""The charts as at first."""
