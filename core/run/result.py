"""The result of a run: trace, phase changes, outcome, reason, warnings and metrics."""

from __future__ import annotations

import hashlib
from dataclasses import asdict, dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from slipgrasp.core.run.metrics import Metrics
from slipgrasp.core.run.provenance import Provenance
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.knowledge import Knowledge, knowledge_of
from slipgrasp.core.trace.ticks import Ticks
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import Outcome, PhaseChange, Reason, RunWarning
from slipgrasp.core.words.display_name import name_run

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True, kw_only=True)
class RunSummary:
    """A finished run without its trace.

    Attributes:
        scenario: Simulated scenario.
        outcome: Outcome of the run.
        reason: Reason for an early end.
        end_time: Simulation time reached [s].
        estimates: Final estimates by dotted key of the unknown.
        metrics: Figures of merit.
        warnings: Warnings about the run.
    """

    scenario: Scenario
    outcome: Outcome
    reason: Reason | None
    end_time: float
    estimates: dict[str, float]
    metrics: Metrics
    warnings: tuple[RunWarning, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class RunResult:
    """A finished run, just simulated or read from a recording.

    Attributes:
        scenario: Simulated scenario.
        trace: Signals over time.
        phase_changes: Transitions of every contact between stick and slip, in time order.
        outcome: Outcome of the run.
        reason: Reason for an early end.
        warnings: Warnings about the run.
        metrics: Figures of merit.
        provenance: Program, numerics and law that computed the run.
        ticks: Commands of the law at every tick; None if they were not recorded.
        has_sample_metrics: Whether the metrics are computed from samples only, as for a recovered
            run or a recording before format 7.
    """

    scenario: Scenario
    trace: Trace
    phase_changes: tuple[PhaseChange, ...]
    outcome: Outcome
    reason: Reason | None
    warnings: tuple[RunWarning, ...]
    metrics: Metrics
    provenance: Provenance
    ticks: Ticks | None = None
    has_sample_metrics: bool = False

    @property
    def end_time(self) -> float:
        """Simulation time reached [s]."""
        return float(self.trace.times[-1])

    @property
    def estimates(self) -> dict[str, float]:
        """Final estimates by dotted key of the unknown."""
        final = self.trace.estimates[-1]
        return {
            key: float(value) for key, value in zip(self.trace.shape.unknowns, final, strict=True)
        }

    @property
    def knowledge(self) -> Knowledge:
        """Known and unknown parameters of the hand and the object."""
        return knowledge_of(self.scenario)

    @property
    def name(self) -> str:
        """Name of the run in lists: the preset, and the differences from it."""
        return name_run(self.scenario)

    @property
    def sha256(self) -> str:
        """SHA-256 of all samples, phase changes and the outcome: equal for bit-identical runs.

        The same numerics give the same hash on every machine; docs/portability.md lists the hashes
        of the presets.
        """
        digest = hashlib.sha256(np.ascontiguousarray(self.trace.to_rows(), "<f8").tobytes())
        changes = [
            (change.time, change.contact, change.from_phase.value, change.to_phase.value)
            for change in self.phase_changes
        ]
        digest.update(np.array(changes, "<f8").tobytes())
        digest.update(self.outcome.value.encode())
        return digest.hexdigest()

    def plot(
        self,
        *signals: str,
        over: Any = None,
        time: tuple[float, float] | None = None,
        title: str | None = None,
    ) -> Figure:
        """Plots signals over time, one below the other, with slip shaded.

        Args:
            signals: Signals (``slip``, ``normal_force``), or single columns (``slip_0``).
            over: A second run, drawn dashed, or measured data, drawn as dots.
            time: Start and end of the time axis [s]; the whole run if None.
            title: Title above the figure, without formulas; None for none.

        Returns:
            A matplotlib figure; ``figure.savefig("slip.pdf")`` saves it.

        Raises:
            ScenarioError: If a run has no such signal, the times are not a valid range, or the
                title is empty or too long.
        """
        # Figures are a layer above the core, and matplotlib takes a second to load.
        draw = import_module("slipgrasp.figures.signals").draw_signals
        return draw(self, signals or ("slip", "normal_force"), over=over, time=time, title=title)

    def summary(self) -> dict[str, Any]:
        """The run without its trace, as plain values for JSON (the ``run --json`` object)."""
        return {
            "name": self.name,
            "outcome": self.outcome.value,
            "reason": None if self.reason is None else asdict(self.reason),
            "end_time": self.end_time,
            "phase_changes": [
                {
                    "time": change.time,
                    "contact": change.contact,
                    "from": change.from_phase.label,
                    "to": change.to_phase.label,
                }
                for change in self.phase_changes
            ],
            "estimates": self.estimates,
            **self.knowledge.to_mapping(),
            "metrics": asdict(self.metrics),
            "warnings": [asdict(warning) for warning in self.warnings],
            "law": None if self.provenance.law is None else asdict(self.provenance.law),
        }
