"""The control laws side by side: one run of the scenario with each."""

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
        problem: Why there is none.
    """

    kind: str
    result: RunResult | None
    problem: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class LawsView:
    """Runs of one scenario with each law, as far as they are there.

    Attributes:
        draft: What was asked for when they were; None if they never were.
        runs: The runs; those of an older draft stay until newer ones replace them.
    """

    draft: Draft | None = None
    runs: tuple[LawRun, ...] = ()

    def with_run(self, run: LawRun) -> LawsView:
        """With a run in place of the one with the same law."""
        if any(each.kind == run.kind for each in self.runs):
            runs = (run if each.kind == run.kind else each for each in self.runs)
            return replace(self, runs=tuple(runs))
        return replace(self, runs=(*self.runs, run))
