"""One run of a study that breaks its worker costs that run alone, and killed workers cost none."""

from __future__ import annotations

import os
import signal
import threading
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.processes import family_of
from slipgrasp.core.executors.inline import InlineExecutor
from slipgrasp.core.executors.processes import ProcessExecutor
from slipgrasp.core.study.definition import Study
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.study import scheduler
from slipgrasp.recordings.study.study_row import StudyRow
from tests.recordings import faulty_runs
from tests.recordings.studying import make_study, write_study
from tests.waiting import PATIENCE

pytestmark = pytest.mark.slow

KILLS, PAUSE = 6, 0.1


def quick_study(runs: int) -> Study:
    return make_study(
        set={"simulation.duration": 0.2},
        sampling={"method": "random", "runs": runs, "seed": 3},
        vary={"object.mass": {"min": 1.0, "max": 1.4}},
    )


def run_in_processes(study: Study, path: Path) -> list[StudyRow]:
    rows: list[StudyRow] = []
    end = write_study(study, path, rows.append, executor=ProcessExecutor(2))
    assert end.state == "completed"
    return rows


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory) -> tuple[Study, list[StudyRow]]:
    study, rows = quick_study(20), list[StudyRow]()
    write_study(study, tmp_path_factory.mktemp("study") / "whole.mcap", rows.append)
    return study, rows


def test_a_run_that_breaks_its_worker_costs_that_run_with_its_reason(
    undisturbed, tmp_path, monkeypatch
) -> None:
    study, whole = undisturbed
    monkeypatch.setattr(scheduler, "run_task", faulty_runs.segmentation_fault)
    rows = run_in_processes(study, tmp_path / "broken.mcap")
    lost = rows[faulty_runs.FAULTY_RUN]
    assert lost.outcome is Outcome.FAILED and lost.reason is not None
    assert lost.reason.code == "worker_died" and "killed by SIGSEGV" in lost.reason.message
    assert rows == [lost if row.index == lost.index else row for row in whole]


def test_a_study_of_which_six_workers_are_killed_in_a_row_is_the_same_file(tmp_path) -> None:
    study = quick_study(600)
    write_study(study, tmp_path / "whole.mcap")
    others, killed = set(family_of(os.getpid())), []

    def kill_six() -> None:
        deadline = time.monotonic() + PATIENCE
        while len(killed) < KILLS and time.monotonic() < deadline:
            time.sleep(PAUSE)
            for worker in sorted(set(family_of(os.getpid())) - others)[:1]:
                with suppress(ProcessLookupError):
                    os.kill(worker, signal.SIGKILL)
                    killed.append(time.monotonic())

    killer = threading.Thread(target=kill_six)
    killer.start()
    run_in_processes(study, tmp_path / "killed.mcap")
    killer.join()
    assert len(killed) == KILLS
    assert (tmp_path / "killed.mcap").read_bytes() == (tmp_path / "whole.mcap").read_bytes()


def test_recordings_are_kept_as_they_come_and_not_held_until_their_row_is_next(tmp_path) -> None:
    study = replace(quick_study(40), recordings="all")
    kept: list[int] = []

    class LastFirst(InlineExecutor):
        name, num_workers = "last first", 1

        def map(self, function, tasks, *, should_stop):
            for finished in list(super().map(function, tasks, should_stop=should_stop))[::-1]:
                yield finished
                assert finished.result is not None
                assert finished.result[-1].row.index in kept

    keep = lambda run: str(kept.append(run.row.index))  # noqa: E731
    write_study(study, tmp_path / "study.mcap", executor=LastFirst(), keep=keep)
    assert sorted(kept) == list(range(40)) and kept != sorted(kept)
