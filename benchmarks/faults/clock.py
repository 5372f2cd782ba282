"""A service whose wall clock jumps forwards and back during work (Linux, with a C compiler)."""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
import urllib.request
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from benchmarks.faults.services import POLL, start_service
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.file.recorder import record

LARGEST_JUMP = 10_800
"""Largest deviation of the clock from the right time [s]."""

JUMPING = """
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <sys/time.h>
#include <time.h>

/* The right time and half of a second are in the same jump; the next is anywhere. */
static time_t jump(const struct timespec *now) {
    unsigned seed = 2 * now->tv_sec + (now->tv_nsec >= 500000000);
    return rand_r(&seed) % (2 * LARGEST + 1) - LARGEST;
}

int clock_gettime(clockid_t which, struct timespec *now) {
    static int (*real)(clockid_t, struct timespec *);
    if (!real) real = dlsym(RTLD_NEXT, "clock_gettime");
    int failed = real(which, now);
    if (!failed && which == CLOCK_REALTIME) now->tv_sec += jump(now);
    return failed;
}

time_t time(time_t *told) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (told) *told = now.tv_sec;
    return now.tv_sec;
}
"""


@dataclass(frozen=True, slots=True)
class ClockJumps:
    """Runs and studies under a clock that jumps twice a second.

    Attributes:
        runs: Number of runs requested over REST, including those of a study; all are as without
            jumps.
        furthest: Largest difference of their stated creation times [s].
    """

    runs: int
    furthest: float


def jump_while_serving(runs: int) -> ClockJumps:
    """Requests runs and a study from a service while its wall clock jumps by hours.

    Args:
        runs: Number of runs, and of rows of the study.

    Raises:
        AssertionError: If one fails, differs from one simulated here, or has the id of another, or
            if the service logs an unhandled error.
    """
    with tempfile.TemporaryDirectory() as name:
        folder, log = Path(name), Path(name) / "log.txt"
        environment = {**os.environ, "LD_PRELOAD": str(_compile(folder))}
        with log.open("wb") as stream:
            service, url = start_service(folder, stream, environment)
        with service:
            try:
                made = [_simulate(url, _run(i)) for i in range(runs)]
                study = _ask(url, "studies", _study(runs))
                _follow(url, study["id"])
                study = _ask(url, f"studies/{study['id']}")
                for i, run in enumerate(made):
                    _check(url, run, i, folder)
            finally:
                service.terminate()
        assert "Traceback" not in log.read_text()
    assert (study["state"], study["finished"]) == ("completed", runs)
    assert len({run["id"] for run in made}) == runs
    times = [_seconds(run["created"]) for run in made]
    return ClockJumps(2 * runs, max(times) - min(times))


def _compile(folder: Path) -> Path:
    source, library = folder / "jumping.c", folder / "jumping.so"
    source.write_text(JUMPING)
    options = ["-shared", "-fPIC", f"-DLARGEST={LARGEST_JUMP}", "-o", str(library), str(source)]
    subprocess.run(["cc", *options, "-ldl"], check=True)
    return library


def _run(i: int) -> dict[str, Any]:
    values = {"simulation.duration": 0.5, "object.mass": 1.0 + 0.01 * i}
    return {"scenario": "paper-case-1", "set": values}


def _simulate(url: str, body: dict[str, Any]) -> dict[str, Any]:
    """A run after its end; on a busy machine the first response comes earlier."""
    run = _ask(url, "runs", body)
    while "outcome" not in run:
        time.sleep(POLL)
        run = _ask(url, f"runs/{run['id']}")
    return run


def _study(runs: int) -> dict[str, Any]:
    return {
        "base": "paper-case-1",
        "set": {"simulation.duration": 0.2},
        "sampling": {"method": "random", "runs": runs, "seed": 1},
        "vary": {"object.mass": {"min": 0.8, "max": 1.6}},
    }


def _check(url: str, run: dict[str, Any], i: int, folder: Path) -> None:
    """Compares a recording with one made here, with a correct clock."""
    assert run["outcome"] == "completed", run
    asked = _run(i)
    here = folder / f"here-{i}.mcap"
    record(with_values(load_scenario(asked["scenario"]), asked["set"]), here)
    with urllib.request.urlopen(f"{url}api/v1/runs/{run['id']}/recording") as answer:
        assert answer.read() == here.read_bytes(), "the clock has changed a recording"


def _follow(url: str, study_id: str) -> None:
    """Waits for the end of a study."""
    with urllib.request.urlopen(f"{url}api/v1/studies/{study_id}/events") as events:
        assert b"event: end" in events.read()


def _ask(url: str, path: str, body: dict[str, Any] | None = None) -> dict[str, Any]:
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(
        f"{url}api/v1/{path}", data, {"Content-Type": "application/json"}
    )
    with urllib.request.urlopen(request) as answer:
        found: dict[str, Any] = json.load(answer)
    return found


def _seconds(created: str) -> float:
    return datetime.fromisoformat(created).timestamp()
