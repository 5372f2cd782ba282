"""One row per run of a study: what varied, how it ended, its figures and the hash of its trace."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any

from pydantic import TypeAdapter, ValidationError

from slipgrasp.core.run.claims import describe_false_end
from slipgrasp.core.run.provenance import present_provenance
from slipgrasp.core.run.result import RunSummary
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.study.definition import Value
from slipgrasp.core.trace.types import Outcome, Reason
from slipgrasp.recordings.file.documents import parse_json
from slipgrasp.recordings.file.state_hash import HASH_BYTES, StateHash

Figures = dict[str, float | int | bool | None]
"""The metrics of a run by their names; None where there is none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyRow:
    """What is kept of every run of a study.

    Attributes:
        index: The run's number in the study, from 0.
        values: What it sets in the base, by dotted key.
        outcome: How it ended.
        reason: Why, where it ended early.
        end_time: Simulation time reached [s].
        metrics: Its figures of merit; empty if it could not be simulated at all.
        state_hash: Hash of its samples and phase changes (`slipgrasp.recordings.file.state_hash`);
            empty if it could not be simulated at all.
        kernel: Name of the numerics that computed it (`slipgrasp.core.run.provenance`).
        recording: Id of its recording, None if none is kept.
    """

    index: int
    values: dict[str, Value]
    outcome: Outcome
    reason: Reason | None
    end_time: float
    metrics: Figures
    state_hash: str
    kernel: str
    recording: str | None = None


class RowsHash:
    """The hash of the rows of a study as they were encoded, however they lie in chunks."""

    def __init__(self) -> None:
        self._hash = hashlib.blake2b(digest_size=HASH_BYTES)

    def add(self, payload: bytes) -> None:
        """Adds the next row."""
        self._hash.update(len(payload).to_bytes(4, "little") + payload)

    def hexdigest(self) -> str:
        """The hash so far, in hexadecimal digits."""
        return self._hash.hexdigest()


class RunHash:
    """The hash of a run, taken while it goes on; what it has taken may be released.

    Attributes:
        num_rows: Samples that it has taken.
        num_ticks: Ticks that it has taken.
    """

    def __init__(self) -> None:
        self.num_rows = self.num_ticks = 0
        self._num_changes = 0
        self._state = StateHash()

    def take(self, simulation: Simulation) -> None:
        """Adds what is new and never changes."""
        rows = simulation.rows_from(self.num_rows)
        if simulation.finished and simulation.num_rows == 0:
            rows = simulation.all_rows()
        ticks = simulation.ticks_from(self.num_ticks).to_rows()
        changes = simulation.phase_changes_from(self._num_changes)
        self._state.add_samples(rows)
        self._state.add_ticks(ticks)
        self._state.add_phase_changes(changes)
        self.num_rows += len(rows)
        self.num_ticks += len(ticks)
        self._num_changes += len(changes)

    def hexdigest(self) -> str:
        """The hash so far, in hexadecimal digits."""
        return self._state.digest().hex()


def row_of(
    index: int, values: Mapping[str, Value], simulation: Simulation, state_hash: str
) -> StudyRow:
    """The row of a run that was simulated to its end.

    Args:
        index: The number of the run.
        values: What it sets in the base.
        simulation: The run.
        state_hash: Hash of all of it.
    """
    summary = _judged(simulation.summary())
    return StudyRow(
        index=index,
        values=dict(values),
        outcome=summary.outcome,
        reason=summary.reason,
        end_time=summary.end_time,
        metrics={name: _finite(value) for name, value in summary.metrics.flattened().items()},
        state_hash=state_hash,
        kernel=present_provenance(simulation.scenario.space).kernel,
    )


def _judged(summary: RunSummary) -> RunSummary:
    """The summary; one that claims to be complete and is not has failed."""
    duration = summary.scenario.simulation.duration
    finding = describe_false_end(summary.outcome, summary.end_time, duration)
    if not finding:
        return summary
    reason = Reason(
        code="contradictory_end",
        message=f"the run says that it is complete, but {finding}",
        contact=None,
        time=summary.end_time,
        value=summary.end_time,
        limit=duration,
        hint="choose values further from the ends of their ranges, and report it",
    )
    metrics = replace(summary.metrics, held=False)
    return replace(summary, outcome=Outcome.FAILED, reason=reason, metrics=metrics)


def encode_row(row: StudyRow) -> bytes:
    """The row as JSON, whose numbers read back to the same bits."""
    # By hand: `asdict` copies deeply, which would take as long as all the rest.
    document = {
        "index": row.index,
        "values": row.values,
        "outcome": row.outcome.value,
        "reason": None if row.reason is None else _reason_document(row.reason),
        "end_time": row.end_time,
        "metrics": row.metrics,
        "state_hash": row.state_hash,
        "kernel": row.kernel,
        "recording": row.recording,
    }
    return json.dumps(document, ensure_ascii=False, allow_nan=False).encode()


def decode_row(payload: bytes) -> StudyRow:
    """The inverse of `encode_row`.

    Raises:
        ValueError: If it is not what `encode_row` makes of a row.
    """
    try:
        return _reader().validate_python(parse_json(payload))
    except ValidationError as error:
        raise ValueError("a row is malformed") from error


def row_schema() -> dict[str, Any]:
    """The JSON schema of a row."""
    return _reader().json_schema()


def _reason_document(reason: Reason) -> dict[str, Any]:
    return {**asdict(reason), "value": _finite(reason.value), "limit": _finite(reason.limit)}


@cache
def _reader() -> TypeAdapter[StudyRow]:
    return TypeAdapter(StudyRow)


def _finite(value: float | int | bool | None) -> float | int | bool | None:
    """JSON has no infinity; a figure that is not finite is as good as none."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
