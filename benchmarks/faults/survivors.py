"""SIGKILL of `slipgrasp run` and `slipgrasp serve` at any instant: recordings have equal bytes.

`python -m benchmarks.faults.survivors RANDOM LAST SEED` kills RANDOM processes at random instants,
and LAST within the last second of a recording. A recording that states its end must equal the file
of an undisturbed run, byte for byte; a recovered one must be a prefix of its run. Most processes
start with all modules imported (`benchmarks.faults.warm`), because before that they use no file;
every tenth is a new interpreter.
"""

from __future__ import annotations

import json
import random
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from benchmarks.faults import warm
from benchmarks.faults.services import POLL, start_service
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.recovery import RECORDING_SUFFIX, recover_orphans

PRESET = "paper-case-1"
VALUES = {"simulation.duration": 60.0, "simulation.max_steps": 100_000_000}
"""A run that takes seconds, so that its file is flushed during the run and rewritten later."""

EACH_SERVICE = 5
"""Number of kills per kill of a service, which takes longer to start."""

EACH_COLD = 10
"""Number of kills per kill of a new interpreter."""

LAST_SECOND = 1.0
NEARLY_WHOLE = 0.8
"""The fraction of a file shortly before the last second."""

PATIENCE = 300.0
SHORT_POLL = 0.001


@dataclass(frozen=True, slots=True)
class Survivors:
    """Recordings of killed processes.

    Attributes:
        kills: Number of killed processes.
        whole: Number of recordings with the bytes of an undisturbed run.
        laid_out: Number of these that recovery finished.
        recovered: Number of recordings that are, and state to be, a prefix of the run.
        nothing: Number of runs without a written sample.
    """

    kills: int
    whole: int
    laid_out: int
    recovered: int
    nothing: int


def kill_and_compare(
    at_random: int,
    in_last_second: int,
    seed: int,
    report: Callable[[Counter[str]], None] = lambda _found: None,
) -> Survivors:
    """Kills processes that record, and compares their recordings with an undisturbed run.

    Args:
        at_random: Number of kills at random instants.
        in_last_second: Number of kills in the last second of a recording, or just after it.
        seed: Seed of the instants.
        report: Called with the counts so far after every kill.

    Raises:
        AssertionError: If a recording has other bytes, or another file is left.
    """
    source, found = random.Random(seed), Counter[str]()
    with tempfile.TemporaryDirectory() as name:
        whole = _Whole(Path(name) / f"whole{RECORDING_SUFFIX}")
        for i in range(at_random + in_last_second):
            aim = _at_random if i < at_random else _in_last_second
            kill = _kill_service if i % EACH_SERVICE == 0 else _kill_run
            start = _COLD if source.randrange(EACH_COLD) == 0 else _WARM
            with tempfile.TemporaryDirectory(dir=name) as folder:
                aimed = partial(aim, whole, start, source)
                kill(Path(folder), start, aimed, whole, found)
            found["new interpreter"] += start is _COLD
            report(found)
    kinds = ("whole", "laid out", "recovered", "nothing")
    return Survivors(at_random + in_last_second, *(found[kind] for kind in kinds))


@dataclass(frozen=True, slots=True)
class _Start:
    """Start of processes; each function returns a function that kills one and waits for its end.

    Attributes:
        run: Starts `slipgrasp run` with the recording to write.
        serve: Starts `slipgrasp serve` on a folder; also returns its URL.
    """

    run: Callable[[Path], Callable[[], None]]
    serve: Callable[[Path], tuple[Callable[[], None], str]]


def _run_cold(path: Path) -> Callable[[], None]:
    command = [sys.executable, "-m", "slipgrasp", *_arguments(path)]
    nothing = subprocess.DEVNULL
    return partial(_kill_cold, subprocess.Popen(command, stdout=nothing, stderr=nothing))


def _serve_cold(folder: Path) -> tuple[Callable[[], None], str]:
    process, url = start_service(folder)
    return partial(_kill_cold, process), url


def _kill_cold(process: subprocess.Popen[Any]) -> None:
    with process:
        process.kill()


def _run_warm(path: Path) -> Callable[[], None]:
    return partial(_kill_warm, warm.start(*_arguments(path)))


def _serve_warm(folder: Path) -> tuple[Callable[[], None], str]:
    process, url = warm.start_service(folder)
    return partial(_kill_warm, process), url


def _kill_warm(process: BaseProcess) -> None:
    process.kill()
    process.join()


_COLD = _Start(_run_cold, _serve_cold)
_WARM = _Start(_run_warm, _serve_warm)


class _Whole:
    """The undisturbed run.

    Attributes:
        data: Bytes of its file.
        rows: Number of its samples.
        seconds: Duration of its process [s].
    """

    def __init__(self, path: Path) -> None:
        _seconds_of_run(_WARM, path)  # the first one waits for the process that forks
        self.seconds = {start: _seconds_of_run(start, path) for start in (_COLD, _WARM)}
        self.data = path.read_bytes()
        self.rows = read_recording(path).trace.to_rows()


def _seconds_of_run(start: _Start, path: Path) -> float:
    """Time until a recording has its final name [s]."""
    path.unlink(missing_ok=True)
    began = time.monotonic()
    kill = start.run(path)
    _wait_until(path.exists)
    seconds = time.monotonic() - began
    kill()
    return seconds


_Parts = Callable[[], list[Path]]
_Aim = Callable[[_Parts], None]


def _at_random(whole: _Whole, start: _Start, source: random.Random, _parts: _Parts) -> None:
    time.sleep(source.uniform(0.0, 1.1 * whole.seconds[start]))


def _in_last_second(whole: _Whole, _start: _Start, source: random.Random, parts: _Parts) -> None:
    """Waits until a file is nearly complete and longer, or is rewritten, or has its name."""
    _wait_until(lambda: max(map(_size, parts()), default=0) >= NEARLY_WHOLE * len(whole.data))
    if source.random() < 0.5:
        _wait_until(lambda: any(not path.name.endswith(".mcap.part") for path in parts()))
    else:
        # Mostly early: less than a second is left once the file has this size.
        time.sleep(LAST_SECOND * source.random() ** 2)


def _wait_until(holds: Callable[[], bool]) -> None:
    deadline = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < deadline, "the run is not recorded"
        time.sleep(SHORT_POLL)


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except FileNotFoundError:
        return 0


def _arguments(path: Path) -> list[str]:
    values = [word for key, value in VALUES.items() for word in ("--set", f"{key}={value}")]
    return ["run", PRESET, *values, "--output", str(path)]


def _kill_run(folder: Path, start: _Start, aim: _Aim, whole: _Whole, found: Counter[str]) -> None:
    path = folder / f"run{RECORDING_SUFFIX}"
    kill = start.run(path)
    aim(lambda: list(folder.glob(f"run{RECORDING_SUFFIX}*")))
    kill()
    was_named = path.exists()
    recover_orphans(folder)
    _check(folder, path, was_named, whole, found)


def _kill_service(
    folder: Path, start: _Start, aim: _Aim, whole: _Whole, found: Counter[str]
) -> None:
    kill, url = start.serve(folder)
    path = folder / f"{_ask(url)}{RECORDING_SUFFIX}"
    aim(lambda: list(folder.glob(f"{path.name}*")))
    kill()
    was_named = path.exists()
    kill, url = start.serve(folder)
    while _get(url, "health")["recovering"]:
        time.sleep(POLL)
    kill()
    _check(folder, path, was_named, whole, found)


def _ask(url: str) -> str:
    body = json.dumps({"scenario": PRESET, "set": VALUES}).encode()
    headers = {"Content-Type": "application/json", "Prefer": "respond-async"}
    request = urllib.request.Request(f"{url}api/v1/runs", body, headers)
    with urllib.request.urlopen(request) as answer:
        return str(json.load(answer)["id"])


def _get(url: str, path: str) -> dict[str, int]:
    with urllib.request.urlopen(f"{url}api/v1/{path}") as answer:
        found: dict[str, int] = json.load(answer)
    return found


def _check(folder: Path, path: Path, was_named: bool, whole: _Whole, found: Counter[str]) -> None:
    """Compares the recording of one run, and checks that there are no other files."""
    left = [file.name for file in folder.iterdir() if file.name.startswith(path.stem)]
    parts = [name for name in left if name.endswith(".part")]
    assert not parts, f"left beside the recording: {parts}"
    if not path.exists():
        found["nothing"] += 1
        return
    result = read_recording(path)
    if result.outcome is Outcome.RECOVERED:
        _check_prefix(result, whole)
        found["recovered"] += 1
        return
    assert path.read_bytes() == whole.data, f"{path.name} has other bytes than an equal run"
    found["whole"] += 1
    found["laid out"] += not was_named


def _check_prefix(result: RunResult, whole: _Whole) -> None:
    rows = result.trace.to_rows()
    assert rows.tobytes() == whole.rows[: len(rows)].tobytes(), "a sample differs"


if __name__ == "__main__":
    random_kills, last_kills, chosen_seed = map(int, sys.argv[1:4])
    print(kill_and_compare(random_kills, last_kills, chosen_seed, partial(print, flush=True)))
