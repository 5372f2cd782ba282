"""Content of a recording, checked for consistency and converted to a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.metrics import HOLD_WINDOW, METRICS, Metrics, metrics_of_trace
from slipgrasp.core.run.provenance import Provenance
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.trace.signals import SIGNALS, Signal, TraceShape
from slipgrasp.core.trace.ticks import Ticks
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase, Outcome, PhaseChange
from slipgrasp.core.words.interruptions import describe_cut_off
from slipgrasp.recordings.exceptions import (
    AlteredRecordingError,
    DamagedRecordingError,
    NothingToRecoverError,
)
from slipgrasp.recordings.file.documents import (
    SCENARIO_ATTACHMENT,
    START,
    STOP,
    Ending,
    documents_hash,
    read_provenance,
    read_scenario,
    read_stop,
    stop_is_unchanged,
)
from slipgrasp.recordings.file.foxglove.layouts import DISPLAY_RATE
from slipgrasp.recordings.file.schemas import (
    CHECKPOINTS,
    PHASE_CHANGES,
    SAMPLE_TOPICS,
    TICKS,
    TIME_SIGNAL,
)
from slipgrasp.recordings.file.state_hash import StateHash
from slipgrasp.recordings.file.versions import FIRST_FORMAT_WITH, FIRST_FORMAT_WITH_STEP_METRICS

FINEST_DISPLAY = 1e9
"""Times of messages are integers in nanoseconds [Hz]."""

FIRST_FORMAT_WITH_HASHES = 2
_HASHED_AT_ONCE = 10_000

Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True, slots=True)
class Contents:
    """The content of a file.

    Attributes:
        name: Name of the file, for errors.
        shape: Shape of the trace.
        metadata: Documents by name.
        attachments: Attached documents by name.
        columns: For each topic that was read, one array per field.
    """

    name: str
    shape: TraceShape
    metadata: Mapping[str, Mapping[str, str]]
    attachments: Mapping[str, bytes]
    columns: Mapping[str, Columns]

    def result(self) -> RunResult:
        """The run of a complete file.

        Raises:
            DamagedRecordingError: If its parts contradict each other.
        """
        ending = self._ending()
        for name, columns in self.columns.items():
            if ending.counts.get(name, 0) != len(columns["t"]):
                raise self._damaged("its number of messages differs from the number written")
        trace = self.trace()
        return self._run(ending, trace, self.phase_changes(), self.ticks())

    def result_of(self, trace: Trace, changes: tuple[PhaseChange, ...]) -> RunResult:
        """The run with some of the samples, and scenario and ending of the file.

        Metrics that are newer than the file format are computed from these samples.

        Raises:
            DamagedRecordingError: If it has no sample, or its documents are invalid.
        """
        return self._run(self._ending(trace), trace, changes, None)

    def _run(
        self, ending: Ending, trace: Trace, changes: tuple[PhaseChange, ...], ticks: Ticks | None
    ) -> RunResult:
        if len(trace) == 0:
            raise self._damaged("it contains no sample")
        has_sample_metrics = self._has_sample_metrics(ending.outcome)
        return RunResult(
            scenario=self._scenario(),
            trace=trace,
            phase_changes=changes,
            outcome=ending.outcome,
            reason=ending.reason,
            warnings=ending.warnings,
            metrics=_as_told_now(ending.metrics, trace) if has_sample_metrics else ending.metrics,
            provenance=self._provenance(),
            ticks=ticks,
            has_sample_metrics=has_sample_metrics,
        )

    def is_unaltered(self) -> bool:
        """Whether samples and documents match their hashes."""
        if not self._has_hashes():
            return True
        state = self._state_hash(self.trace(), self.phase_changes())
        stop = self.metadata[STOP]
        return stop.get("state_hash") == state.hex() and stop_is_unchanged(stop, self._documents())

    @property
    def display_rate(self) -> float:
        """Rate of the display topics [Hz]; the default if the file does not state it."""
        try:
            rate = float(self.metadata[START]["display_rate"])
        except (KeyError, ValueError):
            return DISPLAY_RATE
        return rate if 0.0 <= rate <= FINEST_DISPLAY else DISPLAY_RATE

    def result_so_far(self) -> RunResult:
        """The run of an unfinished file, up to its last valid checkpoint.

        Raises:
            NothingToRecoverError: If it contains no sample.
            DamagedRecordingError: If its parts contradict each other.
        """
        so_far = self._up_to_last_checkpoint() if self._has_hashes() else self._up_to_shortest()
        if STOP in self.metadata and so_far._is_complete():
            return so_far.result()
        trace, changes = so_far.trace(), so_far.phase_changes()
        scenario, outcome = self._scenario(), Outcome.RECOVERED
        rate = scenario.simulation.output_rate
        end = float(trace.times[-1])
        return RunResult(
            scenario=scenario,
            trace=trace,
            phase_changes=changes,
            outcome=outcome,
            reason=describe_cut_off(end),
            warnings=(),
            metrics=metrics_of_trace(trace, changes, outcome, rate),
            provenance=so_far._provenance(),
            ticks=so_far.ticks(),
            has_sample_metrics=True,
        )

    def _is_complete(self) -> bool:
        counts = self._ending().counts
        return all(counts.get(name, 0) == len(c["t"]) for name, c in self.columns.items())

    def _up_to_last_checkpoint(self) -> Contents:
        checkpoints = self.columns[CHECKPOINTS.name]
        if len(checkpoints["t"]) == 0:
            raise NothingToRecoverError(self.name, "it ends before its first sample")
        last = {name: values[-1] for name, values in checkpoints.items()}
        so_far = self._cut(
            int(last["samples"]), int(last["phase_changes"]), int(last.get("ticks", 0))
        )
        state = so_far._state_hash(so_far.trace(), so_far.phase_changes())
        if (
            last["documents_hash"].tobytes() != self._documents()
            or last["state_hash"].tobytes() != state
        ):
            raise AlteredRecordingError(self.name)
        return so_far

    def _up_to_shortest(self) -> Contents:
        """The samples that all topics have, for format 1, which had no checkpoints."""
        samples = min(len(self.columns[topic.name]["t"]) for topic in SAMPLE_TOPICS)
        return self._cut(samples, len(self.columns[PHASE_CHANGES.name]["t"]), 0)

    def _cut(self, samples: int, changes: int, ticks: int) -> Contents:
        if samples == 0:
            raise NothingToRecoverError(self.name, "it ends before its first sample")
        lengths = {topic.name: samples for topic in SAMPLE_TOPICS}
        lengths |= {PHASE_CHANGES.name: changes, TICKS.name: ticks}
        columns = {
            name: {key: values[: lengths.get(name)] for key, values in columns.items()}
            for name, columns in self.columns.items()
        }
        return Contents(self.name, self.shape, self.metadata, self.attachments, columns)

    def _has_hashes(self) -> bool:
        start = self.metadata[START]
        return int(start["format"]) >= FIRST_FORMAT_WITH_HASHES or "kernel" in start

    def _documents(self) -> bytes:
        return documents_hash(self.metadata[START], self._scenario_document())

    def _state_hash(self, trace: Trace, changes: tuple[PhaseChange, ...]) -> bytes:
        version = int(self.metadata[START]["format"])
        state = StateHash(version)
        # Signals of hands count as 0 without a hand; those of later formats do not count.
        signals = [s for s in SIGNALS if FIRST_FORMAT_WITH.get(s.name, 1) <= version]
        for start in range(0, len(trace), _HASHED_AT_ONCE):
            state.add_samples(trace[start : start + _HASHED_AT_ONCE].to_rows(signals))
        state.add_phase_changes(changes)
        if (ticks := self.ticks()) is not None:
            state.add_ticks(ticks.to_rows())
        return state.digest()

    def _provenance(self) -> Provenance:
        try:
            return read_provenance(self.metadata[START])
        except (KeyError, ValueError) as error:
            raise self._damaged("its start document is malformed") from error

    def _ending(self, part: Trace | None = None) -> Ending:
        stop = self.metadata.get(STOP)
        if stop is None:
            raise self._damaged("its end document is missing")
        try:
            ending = read_stop(stop, self._later_metrics(Outcome(stop["outcome"]), part))
        except (KeyError, ValueError) as error:
            raise self._damaged("its end document is malformed") from error
        if not ending.metrics.are_of(self.shape.num_contacts):
            raise self._damaged("its metrics do not match its samples")
        contact = None if ending.reason is None else ending.reason.contact
        if contact is not None and contact not in range(self.shape.num_contacts):
            raise self._damaged("its reason refers to a contact that does not exist")
        return ending

    def _later_metrics(self, outcome: Outcome, part: Trace | None) -> dict[str, Any]:
        """Metrics that are newer than the file format, computed from its samples."""
        version = int(self.metadata[START]["format"])
        later = [m.name for m in METRICS if FIRST_FORMAT_WITH.get(m.name, 1) > version]
        if not later:
            return {}
        rate = self._scenario().simulation.output_rate
        trace = self.trace() if part is None else part
        if len(trace) == 0:
            raise self._damaged("it contains no sample")
        computed = metrics_of_trace(trace, self.phase_changes(), outcome, rate)
        return {name: getattr(computed, name) for name in later}

    def _has_sample_metrics(self, outcome: Outcome) -> bool:
        version = int(self.metadata[START]["format"])
        return version < FIRST_FORMAT_WITH_STEP_METRICS or outcome is Outcome.RECOVERED

    def _scenario_document(self) -> bytes:
        document = self.attachments.get(SCENARIO_ATTACHMENT)
        if document is None:
            raise self._damaged("its scenario is missing")
        return document

    def _scenario(self) -> Scenario:
        try:
            scenario = read_scenario(self._scenario_document())
        except ValueError as error:
            raise self._damaged(f"its scenario is not valid: {error}") from error
        unknowns = tuple(estimate.parameter for estimate in scenario.estimates)
        if (self.shape.num_contacts, self.shape.unknowns) != (len(scenario.fingers), unknowns):
            raise self._damaged("its scenario does not match its samples")
        return scenario

    def trace(self) -> Trace:
        """The samples; signals that were not read are absent.

        Raises:
            DamagedRecordingError: If the samples are invalid.
        """
        arrays: Columns = {}
        for topic in SAMPLE_TOPICS:
            if topic.name not in self.columns:
                continue
            columns = dict(self.columns[topic.name])
            times = columns.pop("t")
            first = arrays.setdefault(TIME_SIGNAL.name, times)
            if not np.array_equal(times, first):
                raise self._damaged(f"the samples of {topic.name} have different times")
            arrays |= columns
        phases = (values for values in arrays.values() if values.dtype == np.int8)
        known = ContactPhase.known(self.shape.space)
        if not all(np.isin(values, known).all() for values in phases):
            raise self._damaged("it contains a phase that does not exist")
        if not all(np.isfinite(values).all() for values in arrays.values()):
            raise self._damaged("it contains a number that is not finite")
        if (np.diff(arrays[TIME_SIGNAL.name]) < 0.0).any():
            raise self._damaged("its samples are not in time order")
        num_samples = len(arrays[TIME_SIGNAL.name])
        missing = [signal for signal in SIGNALS if signal.name not in arrays]
        arrays |= {signal.name: self._zeros(signal, num_samples) for signal in missing}
        absent = frozenset(signal.name for signal in missing if self.shape.has(signal))
        return Trace(shape=self.shape, absent=absent, **arrays)

    def _zeros(self, signal: Signal, count: int) -> NDArray[Any]:
        shape = (count,) if signal.per == "" else (count, self.shape.width(signal))
        return np.zeros(shape, np.int8 if signal.holds_phases else np.float64)

    def phase_changes(self) -> tuple[PhaseChange, ...]:
        """The phase changes.

        Raises:
            DamagedRecordingError: If the phase changes are invalid.
        """
        columns = self.columns[PHASE_CHANGES.name]
        if (columns["contact"] >= self.shape.num_contacts).any():
            raise self._damaged("it contains a phase change of a contact that does not exist")
        if (np.diff(columns["t"]) < 0.0).any():
            raise self._damaged("its phase changes are not in time order")
        rows = zip(*(columns[field.name].tolist() for field in PHASE_CHANGES.fields), strict=True)
        try:
            return tuple(
                PhaseChange(
                    time=time,
                    contact=contact,
                    from_phase=ContactPhase(from_phase),
                    to_phase=ContactPhase(to_phase),
                )
                for time, contact, from_phase, to_phase in rows
            )
        except ValueError as error:
            raise self._damaged("it contains a phase that does not exist") from error

    def ticks(self) -> Ticks | None:
        """The commands of the law; None if the format did not include them.

        Raises:
            DamagedRecordingError: If the commands are invalid.
        """
        if TICKS.name not in self.columns:
            return None
        columns = dict(self.columns[TICKS.name])
        ticks = Ticks(times=columns.pop("t"), **columns)
        if not all(np.isfinite(values).all() for values in columns.values()):
            raise self._damaged("it contains a command that is not finite")
        if (np.diff(ticks.times) <= 0.0).any():
            raise self._damaged("its ticks are not in time order")
        return ticks

    def _damaged(self, finding: str) -> DamagedRecordingError:
        return DamagedRecordingError(self.name, finding)


def _as_told_now(metrics: Metrics, trace: Trace) -> Metrics:
    """Corrects the metrics of a run that older formats call held although it is too short."""
    is_short = float(trace.times[-1] - trace.times[0]) < HOLD_WINDOW
    return replace(metrics, held=None) if metrics.held and is_short else metrics
