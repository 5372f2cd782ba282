"""One row per run of a study: varied values, outcome, metrics and hash of the trace."""

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
from slipgrasp.core.study.limits import is_past
from slipgrasp.core.trace.types import Outcome, Reason
from slipgrasp.recordings.file.documents import parse_json
from slipgrasp.recordings.file.state_hash import HASH_BYTES, StateHash

Figures = dict[str, float | int | bool | None]
"""The metrics of a run by name; None if missing."""

_NO_LIMITS: Mapping[str, float] = {}


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyRow:
    """The result of a run of a study.

    Attributes:
        index: Index of the run, from 0.
        values: Values that it sets in the base, by dotted key.
        outcome: Outcome of the run.
        reason: Reason for an early end.
        end_time: Simulation time reached [s].
        metrics: Metrics; empty if it could not be simulated.
        state_hash: Hash of its samples, phase changes and ticks
            (`slipgrasp.recordings.file.state_hash`); empty if it could not be simulated.
        kernel: Name of the numerics that computed it (`slipgrasp.core.run.provenance`).
        recording: Id of its recording, None if there is none.
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
    """Hash of the encoded rows of a study, independent of the division into chunks."""

    def __init__(self) -> None:
        self._hash = hashlib.blake2b(digest_size=HASH_BYTES)

    def add(self, payload: bytes) -> None:
        """Adds the next row."""
        self._hash.update(len(payload).to_bytes(4, "little") + payload)

    def hexdigest(self) -> str:
        """The hash so far, in hexadecimal digits."""
        return self._hash.hexdigest()


class RunHash:
    """Hash of a run in progress; hashed samples may be released.

    Attributes:
        num_rows: Number of hashed samples.
        num_ticks: Number of hashed ticks.
    """

    def __init__(self) -> None:
        self.num_rows = self.num_ticks = 0
        self._num_changes = 0
        self._state = StateHash()

    def take(self, simulation: Simulation) -> None:
        """Adds new final samples."""
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
    index: int,
    values: Mapping[str, Value],
    simulation: Simulation,
    state_hash: str,
    limits: Mapping[str, float] = _NO_LIMITS,
) -> StudyRow:
    """The row of a finished run.

    Args:
        index: Index of the run.
        values: Values that it sets in the base.
        simulation: The run.
        state_hash: Hash of the whole run.
        limits: Largest magnitudes of metrics; a run past one counts as not held.
    """
    summary = _judged(simulation.summary())
    metrics: Figures = {name: _finite(value) for name, value in summary.metrics.flattened().items()}
    if is_past(metrics, limits):
        metrics["held"] = False
    return StudyRow(
        index=index,
        values=dict(values),
        outcome=summary.outcome,
        reason=summary.reason,
        end_time=summary.end_time,
        metrics=metrics,
        state_hash=state_hash,
        kernel=present_provenance(simulation.scenario.space).kernel,
    )


def _judged(summary: RunSummary) -> RunSummary:
    """The summary; a run that wrongly claims to be complete has failed."""
    duration = summary.scenario.simulation.duration
    finding = describe_false_end(summary.outcome, summary.end_time, duration)
    if not finding:
        return summary
    reason = Reason(
        code="contradictory_end",
        message=f"the run claims to be complete, but {finding}",
        contact=None,
        time=summary.end_time,
        value=summary.end_time,
        limit=duration,
        hint="choose values further from the ends of their ranges, and report it",
    )
    metrics = replace(summary.metrics, held=False)
    return replace(summary, outcome=Outcome.FAILED, reason=reason, metrics=metrics)


def encode_row(row: StudyRow) -> bytes:
    """Encodes the row as JSON, whose numbers read back to the same bits."""
    # Not `asdict`, whose deep copies would take as long as everything else.
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
    """Decodes a row from `encode_row`.

    Raises:
        ValueError: If the text is not from `encode_row`.
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
    """Replaces values that are not finite with None, because JSON has no infinity."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
