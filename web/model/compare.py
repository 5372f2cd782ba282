"""What tells the run on the screen and the pale one below it apart, as far as that is known."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.recordings.compare.comparison import Comparison

Pair = tuple[int, int]
"""Tickets of two runs: the one on the screen, and the pale one."""


@dataclass(frozen=True, slots=True, eq=False)
class Comparing:
    """The comparison of two runs.

    Attributes:
        pair: Which runs the findings are about; None if there are none.
        findings: What tells them apart; None if they cannot be compared.
        message: Why the latest request was not done, or the runs cannot be compared.
    """

    pair: Pair | None = None
    findings: Comparison | None = None
    message: str = ""
