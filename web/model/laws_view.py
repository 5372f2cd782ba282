"""Runs of the scenario with every control law."""

from __future__ import annotations

from dataclasses import dataclass, replace

from slipgrasp.core.run.result import RunResult
from slipgrasp.web.model.draft import Draft


@dataclass(frozen=True, slots=True, eq=False)
class LawRun:
    """The scenario with one law.

    Attributes:
        kind: Name of the law.
        result: The run; None if there is none.
        problem: Reason if there is none.
    """

    kind: str
    result: RunResult | None
    problem: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class LawsView:
    """Runs of one scenario with every law, as far as available.

    Attributes:
        draft: Their draft; None before the first request.
        runs: The runs; older ones are shown until they are replaced.
    """

    draft: Draft | None = None
    runs: tuple[LawRun, ...] = ()

    def with_run(self, run: LawRun) -> LawsView:
        """Replaces the run of a law."""
        if any(each.kind == run.kind for each in self.runs):
            runs = (run if each.kind == run.kind else each for each in self.runs)
            return replace(self, runs=tuple(runs))
        return replace(self, runs=(*self.runs, run))
