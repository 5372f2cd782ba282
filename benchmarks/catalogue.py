"""Listing, searching and opening a data folder with many recordings."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from contextlib import closing
from dataclasses import replace
from functools import partial
from pathlib import Path

from benchmarks.report import Table
from benchmarks.timing import MILLISECONDS, median_seconds
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.store.run_files import RunFiles, sidecar_text
from slipgrasp.recordings.store.run_index import SMALL
from slipgrasp.recordings.store.run_query import Condition, RunQuery
from slipgrasp.recordings.store.store import RecordingStore

PAGE = 100
QUERIES = {
    "newest first": RunQuery(limit=PAGE),
    "by a metric, falling": RunQuery(limit=PAGE, sort="-slip_path_0"),
    "by preset, tag, text and metric, sorted by name": RunQuery(
        limit=PAGE,
        preset="paper-case-1",
        tags=("odd",),
        text="RUN 1",
        conditions=(Condition("slip_path_0", "<", 0.5),),
        sort="name",
    ),
}
POLL = 0.1
LINKS = 60_000
"""Approximate limit of file systems for the number of names of a file."""


def run(rounds: int = 15, count: int = 10_000) -> list[Table]:
    """The table ``catalogue``: processor time of searches in a folder, each for a page of 100 runs.

    Args:
        rounds: Number of timings of each search.
        count: Number of recordings in the folder.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        fill(folder, count)
        first = _seconds_of_first_listing(folder)
        enter_all(folder)
        kept = _seconds_of_first_listing(folder)
        with closing(RecordingStore(folder)) as store:
            works = {words: partial(store.find, query) for words, query in QUERIES.items()}
            seconds = median_seconds(works, rounds)
    seconds |= {
        "first listing, without a catalogue": first,
        "first listing of another process": kept,
    }
    table = tuple((words, f"{MILLISECONDS * own:.0f}") for words, own in seconds.items())
    note = (
        f"Folders of more than {SMALL} recordings are indexed in the background. "
        "Target: 300 ms with a catalogue."
    )
    return [Table("catalogue", (f"{count} recordings", "CPU [ms]"), table, (note,))]


def fill(folder: Path, count: int) -> None:
    """Links one real recording under many names, each with a separate valid sidecar."""
    scenario = with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.1})
    stored, files = RecordingStore(folder).save(simulate(scenario)), RunFiles(folder)
    source = stored.path
    for number in range(count - 1):
        run_id = f"{number:012}"
        if number % LINKS == 0:
            source = shutil.copyfile(stored.path, files.recording(run_id))
        else:
            os.link(source, files.recording(run_id))
        metrics = stored.summary["metrics"] | {"slip_path": [number / count, 0.0]}
        run = replace(
            stored,
            id=run_id,
            name=f"run {number}",
            tags=("odd",) if number % 2 else ("even", "long"),
            created=f"2026-01-{1 + number % 28:02}T12:{number % 60:02}:00.000+00:00",
            summary=stored.summary | {"metrics": metrics},
        )
        files.sidecar(run_id).write_bytes(sidecar_text(run))


def enter_all(folder: Path) -> int:
    """Lists a folder until its catalogue is complete; returns how many runs it has."""
    with closing(RecordingStore(folder)) as store:
        while (found := store.find(RunQuery(limit=0))).unread:
            time.sleep(POLL)
    return found.count


def _seconds_of_first_listing(folder: Path) -> float:
    with closing(RecordingStore(folder)) as store:
        start = time.process_time()
        found = store.find(RunQuery(limit=PAGE))
        seconds = time.process_time() - start
    assert len(found.runs) == min(found.count, PAGE)
    return seconds
