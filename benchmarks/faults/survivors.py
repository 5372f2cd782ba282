"""SIGKILL of `slipgrasp run` and `slipgrasp serve` at any instant: recordings have equal bytes.

A recording that states its end must equal the file of an undisturbed run, byte for byte; a
recovered one must be a prefix of its run.
"""

from __future__ import annotations

import random
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.faults.kills import PRESET, size_of, start_run, wait_until
from benchmarks.service import POLL, serve
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.recovery import RECORDING_SUFFIX, recover_orphans

VALUES = {"simulation.duration": 60.0, "simulation.max_steps": 100_000_000}
"""A run that takes seconds, so that its file is flushed during the run and rewritten later."""

EACH_SERVICE = 5
"""Number of kills per kill of a service, which takes longer to start."""

LAST_SECOND = 1.0
NEARLY_WHOLE = 0.8
"""The fraction of a file shortly before the last second."""

_Parts = Callable[[], list[Path]]
_Aim = Callable[[_Parts], None]


def kill_and_compare(at_random: int, in_last_second: int, seed: int) -> dict[str, Any]:
    """Kills processes that record, and compares their recordings with an undisturbed run.

    Args:
        at_random: Number of kills at random instants.
        in_last_second: Number of kills in the last second of a recording, or just after it.
        seed: Seed of the instants.

    Returns:
        ``at_random`` and ``in_last_second``; numbers of recordings: ``whole`` with the bytes of an
        undisturbed run, of these ``laid_out`` by recovery, ``recovered`` as a prefix; and of runs
        with ``nothing`` written.

    Raises:
        AssertionError: If a recording has other bytes, or another file is left.
    """
    source, found = random.Random(seed), Counter[str]()
    with tempfile.TemporaryDirectory() as name:
        whole = _Whole(Path(name) / f"whole{RECORDING_SUFFIX}")
        for i in range(at_random + in_last_second):
            aim = _at_random if i < at_random else _in_last_second
            kill = _kill_service if i % EACH_SERVICE == 0 else _kill_run
            with tempfile.TemporaryDirectory(dir=name) as folder:
                path, was_named = kill(Path(folder), partial(aim, whole, source))
                found.update(_check(path, was_named, whole))
    counts = {kind: found[kind] for kind in ("whole", "laid_out", "recovered", "nothing")}
    return {"at_random": at_random, "in_last_second": in_last_second, **counts}


class _Whole:
    """The undisturbed run.

    Attributes:
        data: Bytes of its file.
        rows: Number of its samples.
        seconds: Duration of its process [s].
    """

    def __init__(self, path: Path) -> None:
        began = time.monotonic()
        with start_run(path, VALUES) as process:
            wait_until(path.exists)
            self.seconds = time.monotonic() - began
            process.kill()
        self.data = path.read_bytes()
        self.rows = read_recording(path).trace.to_rows()


def _at_random(whole: _Whole, source: random.Random, _parts: _Parts) -> None:
    time.sleep(source.uniform(0.0, 1.1 * whole.seconds))


def _in_last_second(whole: _Whole, source: random.Random, parts: _Parts) -> None:
    """Waits until a file is nearly complete and longer, or is rewritten, or has its name."""
    wait_until(lambda: max(map(size_of, parts()), default=0) >= NEARLY_WHOLE * len(whole.data))
    if source.random() < 0.5:
        wait_until(lambda: any(not path.name.endswith(".mcap.part") for path in parts()))
    else:
        # Mostly early: less than a second is left once the file has this size.
        time.sleep(LAST_SECOND * source.random() ** 2)


def _kill_run(folder: Path, aim: _Aim) -> tuple[Path, bool]:
    """Kills a run; returns the recovered recording, and whether it had its name before."""
    path = folder / f"run{RECORDING_SUFFIX}"
    with start_run(path, VALUES) as process:
        aim(lambda: list(folder.glob(f"{path.name}*")))
        process.kill()
    was_named = path.exists()
    recover_orphans(folder)
    return path, was_named


def _kill_service(folder: Path, aim: _Aim) -> tuple[Path, bool]:
    """The same with a service, whose successor recovers its recording."""
    body = {"scenario": PRESET, "set": VALUES}
    with serve(folder, kill=True) as service:
        run_id = service.ask("/runs", body, "respond-async")["id"]
        path = folder / f"{run_id}{RECORDING_SUFFIX}"
        aim(lambda: list(folder.glob(f"{path.name}*")))
    was_named = path.exists()
    with serve(folder, kill=True) as successor:
        while successor.ask("/health")["recovering"]:
            time.sleep(POLL)
    return path, was_named


def _check(path: Path, was_named: bool, whole: _Whole) -> list[str]:
    """The kinds of a recording in the counts; there must be no other files of its run."""
    left = [file.name for file in path.parent.iterdir() if file.name.startswith(path.stem)]
    parts = [name for name in left if name.endswith(".part")]
    assert not parts, f"left beside the recording: {parts}"
    if not path.exists():
        return ["nothing"]
    result = read_recording(path)
    if result.outcome is Outcome.RECOVERED:
        rows = result.trace.to_rows()
        assert rows.tobytes() == whole.rows[: len(rows)].tobytes(), "a sample differs"
        return ["recovered"]
    assert path.read_bytes() == whole.data, f"{path.name} has other bytes than an equal run"
    return ["whole"] if was_named else ["whole", "laid_out"]
