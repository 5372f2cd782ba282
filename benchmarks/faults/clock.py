"""A service whose wall clock jumps forwards and back during work (Linux, with a C compiler)."""

from __future__ import annotations

import subprocess
import tempfile
from datetime import datetime
from pathlib import Path
from typing import Any

from benchmarks.service import Service, serve
from benchmarks.study import random_study
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.file.recorder import record

LARGEST_JUMP = 10_800
"""Largest deviation of the clock from the right time [s]."""


def jump_while_serving(runs: int) -> dict[str, Any]:
    """Requests runs and a study from a service while its wall clock jumps by hours.

    Args:
        runs: Number of runs, and of rows of the study.

    Returns:
        Number of ``runs`` with those of the study, all as without jumps; ``furthest``, the largest
        difference of their stated creation times, and the largest ``jump`` [h].

    Raises:
        AssertionError: If one fails, differs from one simulated here, or has the id of another, or
            if the service logs an unhandled error.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        jumping = {"LD_PRELOAD": str(_compile(folder))}
        with serve(folder, environment=jumping) as service:
            made = [service.run_after_end(service.ask("/runs", _run(i))["id"]) for i in range(runs)]
            kept: dict[str, Any] = {"set": {"simulation.duration": 0.2}, "recordings": "all"}
            request = random_study(runs, {"object.mass": (0.8, 1.6)}, **kept)
            study = service.ask("/studies", request)["id"]
            events = service.exchange(f"/studies/{study}/events").content
            assert b"event: end" in events
            ended = service.ask(f"/studies/{study}")
            for i, run in enumerate(made):
                _check(service, run, folder / f"here-{i}.mcap", _run(i))
        assert "Traceback" not in service.log.read_text()
    assert (ended["state"], ended["finished"]) == ("completed", runs)
    assert len({run["id"] for run in made}) == runs
    times = [datetime.fromisoformat(run["created"]).timestamp() for run in made]
    furthest = (max(times) - min(times)) / 3600
    return {"runs": 2 * runs, "furthest": furthest, "jump": LARGEST_JUMP / 3600}


def _compile(folder: Path) -> Path:
    source, library = Path(__file__).with_name("jumping_clock.c"), folder / "jumping.so"
    options = ["-shared", "-fPIC", f"-DLARGEST={LARGEST_JUMP}", "-o", str(library), str(source)]
    subprocess.run(["cc", *options, "-ldl"], check=True)
    return library


def _run(i: int) -> dict[str, Any]:
    values = {"simulation.duration": 0.5, "object.mass": 1.0 + 0.01 * i}
    return {"scenario": "paper-case-1", "set": values}


def _check(service: Service, run: dict[str, Any], here: Path, asked: dict[str, Any]) -> None:
    """Compares a recording with one made here, with a correct clock."""
    assert run["outcome"] == "completed", run
    record(with_values(load_scenario(asked["scenario"]), asked["set"]), here)
    made = service.exchange(f"/runs/{run['id']}/recording").content
    assert made == here.read_bytes(), "the clock has changed a recording"
