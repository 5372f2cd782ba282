"""Journal of a fit: results of its runs, from which an interrupted fit continues.

A fit always requests the same runs in the same order, so that a restarted fit finds simulated runs
in its journal, and ends with the same bits. When the fit is complete, its runs are written as a
study, and the journal is deleted.
"""

from __future__ import annotations

import base64
import json
import os
import time
from pathlib import Path
from typing import Any, Self

import numpy as np

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.fit.problem import FitProblem
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import run_to_end
from slipgrasp.core.study.definition import apply_values
from slipgrasp.core.trace.signals import Floats
from slipgrasp.recordings.exceptions import RecordingBusyError, RecordingWriteError
from slipgrasp.recordings.file.atomic_file import open_locked
from slipgrasp.recordings.study.study_row import (
    RunHash,
    StudyRow,
    decode_row,
    encode_row,
    row_of,
)
from slipgrasp.recordings.study.task import WALL_LIMIT

SYNC_INTERVAL = 1.0


class Journal:
    """Sampled signals of the runs of a fit by parameters, in a file that grows.

    Args:
        path: The file; an unfinished file of the same fit is continued.
        fit: Digest of the fit.

    Attributes:
        rows: Rows of a study, one per run of the fit itself, in order.

    Raises:
        RecordingBusyError: If another process writes it, or it belongs to another fit.
        RecordingWriteError: If a file cannot be written.
    """

    def __init__(self, path: Path, fit: str) -> None:
        self._path = path
        self._fit = fit
        self._places: dict[str, int] = {}
        self._synced_at = time.monotonic()
        self.rows: list[StudyRow] = []

    def __enter__(self) -> Self:
        try:
            self._stream = open_locked(self._path, "another fit is writing it")
            try:
                self._read()
            except BaseException:
                self._stream.close()
                raise
        except OSError as error:
            raise self._failed(error) from error
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    def delete(self) -> None:
        """Deletes the file, after its runs are written elsewhere."""
        self._path.unlink(missing_ok=True)

    def _read(self) -> None:
        """Reads existing entries, up to the first incomplete line."""
        whole = 0
        for line in self._stream:
            entry = _parse(line)
            if entry is None:
                break
            if whole == 0:
                self._check(entry)
            else:
                self._note(entry, whole)
            whole += len(line)
        self._stream.seek(whole)
        self._stream.truncate()
        if whole == 0:
            self._write({"fit": self._fit})

    def _check(self, head: dict[str, Any]) -> None:
        if head.get("fit") != self._fit:
            cause = (
                f"'{self._path.name}' belongs to another fit; give another --output, or replace it "
                "with --force"
            )
            raise RecordingBusyError(self._path, cause)

    def _note(self, entry: dict[str, Any], place: int) -> None:
        self._places[entry["key"]] = place
        if entry["row"] is not None:
            self.rows.append(decode_row(entry["row"].encode()))

    def _write(self, entry: dict[str, Any]) -> int:
        place = self._stream.seek(0, os.SEEK_END)
        try:
            self._stream.write(json.dumps(entry, allow_nan=False).encode() + b"\n")
            self._stream.flush()
            if time.monotonic() - self._synced_at >= SYNC_INTERVAL:
                os.fsync(self._stream.fileno())
                self._synced_at = time.monotonic()
        except OSError as error:
            raise self._failed(error) from error
        return place

    def find(self, key: str) -> Floats | None:
        """The sampled signals of a simulated run; None if it was not simulated."""
        place = self._places.get(key)
        if place is None:
            return None
        self._stream.seek(place)
        entry = json.loads(self._stream.readline())
        return _decode(entry["sampled"], entry["shape"])

    def add(self, key: str, sampled: Floats, row: StudyRow | None) -> None:
        """Appends a run.

        Args:
            key: Parameters of the run.
            sampled: Sampled signals.
            row: Row of a study; None for twins, and for runs that are not allowed.
        """
        text = None if row is None else encode_row(row).decode()
        data = base64.b64encode(np.ascontiguousarray(sampled, "<f8").tobytes()).decode()
        shape = list(sampled.shape)
        entry = {"key": key, "row": text, "shape": shape, "sampled": data}
        self._places[key] = self._write(entry)
        if row is not None:
            self.rows.append(row)

    def _failed(self, error: OSError) -> RecordingWriteError:
        return RecordingWriteError(self._path, error.strerror or type(error).__name__)


class JournaledRuns:
    """Simulates runs that the journal lacks.

    Args:
        journal: The journal.
        as_rows: Whether the runs become rows of the study.
        should_stop: Asked before and during every run; True ends the fit, to be continued.
    """

    def __init__(self, journal: Journal, *, as_rows: bool, should_stop: Any) -> None:
        self._journal = journal
        self._as_rows = as_rows
        self._should_stop = should_stop

    def __call__(self, problem: FitProblem, values: tuple[float, ...]) -> Floats:
        """The sampled signals for values of the parameters; NaN if the run is not allowed."""
        keys = [parameter.key for parameter in problem.parameters]
        key = json.dumps([self._as_rows, dict(zip(keys, values, strict=True))])
        found = self._journal.find(key)
        if found is not None:
            return found
        self._check_stop()
        sampled, row = self._simulate(problem, values)
        self._journal.add(key, sampled, row if self._as_rows else None)
        return sampled

    def _watch(self, simulation: Simulation) -> None:
        if not simulation.finished:
            self._check_stop()

    def _check_stop(self) -> None:
        if self._should_stop():
            raise FitStoppedError(len(self._journal.rows))

    def _simulate(
        self, problem: FitProblem, values: tuple[float, ...]
    ) -> tuple[Floats, StudyRow | None]:
        chosen = problem.scenario_values(values)
        try:
            simulation = Simulation(apply_values(problem.scenario, chosen))
        except ScenarioError:
            return np.full(problem.data.values.shape, np.nan), None
        run_to_end(simulation, self._watch, wall_limit=WALL_LIMIT)
        state = RunHash()
        state.take(simulation)
        number = len(self._journal.rows)
        row = row_of(number, chosen, simulation, state.hexdigest())
        return problem.sample(simulation.result(), values), row


class FitStoppedError(Exception):
    """The fit was stopped and can be continued.

    Attributes:
        runs: Number of runs so far.
    """

    def __init__(self, runs: int) -> None:
        self.runs = runs
        super().__init__(f"stopped after {runs} runs")


def _parse(line: bytes) -> dict[str, Any] | None:
    """An entry; None if the line is incomplete."""
    try:
        return json.loads(line) if line.endswith(b"\n") else None
    except ValueError:
        return None


def _decode(text: str, shape: list[int]) -> Floats:
    return np.frombuffer(base64.b64decode(text), "<f8").reshape(shape)
