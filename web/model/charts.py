"""What the user has made of the charts."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class ChartsView:
    """Which lines are hidden.

    Attributes:
        hidden: Each as the key of its chart and its own key.
    """

    hidden: frozenset[tuple[str, str]] = frozenset()

    def toggled(self, chart: str, line: str) -> ChartsView:
        """With one line hidden, or back."""
        return replace(self, hidden=self.hidden ^ {(chart, line)})

    def hidden_in(self, chart: str) -> frozenset[str]:
        """Keys of the lines that are hidden in a chart."""
        return frozenset(line for key, line in self.hidden if key == chart)
