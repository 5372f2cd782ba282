"""What becomes of a folder whose runs were cut off."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from benchmarks.faults.damage import small_run, write_part
from slipgrasp.core.executors.executor import never
from slipgrasp.core.executors.inline import InlineExecutor
from slipgrasp.core.executors.processes import ProcessExecutor
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.file.atomic_file import part_of
from slipgrasp.recordings.store.recovering import Recovery, recover_run
from slipgrasp.recordings.store.run_files import RunFiles
from slipgrasp.recordings.store.store import RecordingStore

pytestmark = pytest.mark.slow

RUNS = ("aaaaaaaaaaaa", "bbbbbbbbbbbb")


@pytest.fixture
def parts(tmp_path) -> list[Path]:
    """What is left of two runs."""
    files = [RunFiles(tmp_path).recording(run_id) for run_id in RUNS]
    write_part(small_run(), files[0])
    shutil.copy(part_of(files[0]), part_of(files[1]))
    return [part_of(file) for file in files]


@pytest.mark.parametrize("make", [InlineExecutor, lambda: ProcessExecutor(1)])
def test_each_becomes_a_recording_that_is_described(parts, make):
    folder = parts[0].parent
    with make() as executor:
        done = list(executor.map(recover_run, parts, should_stop=never))
    assert [found.result for found in done] == [
        Recovery(path=str(folder / f"{run_id}.mcap")) for run_id in RUNS
    ]
    store = RecordingStore(folder)
    listed = store.list()
    assert {run.id for run in listed} == set(RUNS)
    for run in listed:
        assert run.summary["outcome"] == Outcome.RECOVERED
        assert run.summary["end_time"] == store.open(run.id).end_time > 0.0
        assert RunFiles(folder).read_sidecar(run.id).description is not None
    assert not list(folder.glob("*.part"))


def test_what_was_written_about_a_run_stays(parts):
    files = RunFiles(parts[0].parent)
    files.sidecar(RUNS[0]).write_text('{"name": "mine", "created": "2024-05-06T07:08:09+00:00"}')
    recover_run(parts[0], never)
    found = files.read(RUNS[0])
    assert (found.name, found.created) == ("mine", "2024-05-06T07:08:09.000+00:00")


def test_what_holds_nothing_is_told_of_and_kept(parts):
    parts[0].write_bytes(b"nothing of use")
    found = recover_run(parts[0], never)
    assert found.path == "" and found.fault != ""
    kept = parts[0].with_name(f"{RUNS[0]}.mcap.damaged")
    assert kept.read_bytes() == b"nothing of use" and not parts[0].exists()
