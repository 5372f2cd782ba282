"""A service under mixed load for a given time: its responses, resources and log.

The load comes in intervals. After each, the service is idle for the lifetime of a connection, so
that only unreleased resources remain.
"""

from __future__ import annotations

import random
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.processes import background_threads, family_of, memory_of, own_memory_of, watch
from benchmarks.report import Table
from benchmarks.service import serve
from benchmarks.soak.asking import Tally
from benchmarks.soak.researcher import Researcher
from benchmarks.soak.strangers import Loiterer, play_prank
from benchmarks.soak.visitors import visit_until

__all__ = ["Soak", "run", "soak"]

SPELL, REST = 280.0, 20.0
PERIOD = 5.0
SETTLED = 0.25
RESEARCHERS = 2
PAUSES = {"Researcher": 0.5, "Prankster": 0.5, "Loiterer": 2.0}
"""Mean time between two actions of each user [s]."""

HOUR = 3600.0


class Sample(NamedTuple):
    """Resources at one instant.

    Attributes:
        time: Time since the start [s].
        service_memory: Memory of the service, including its part of shared pages [B].
        own_memory: The part of it that the service has written itself [B].
        worker_memory: Memory of its descendants, including their parts of shared pages [B].
        descriptors: Number of open files and sockets of the service.
    """

    time: float
    service_memory: int
    own_memory: int
    worker_memory: int
    descriptors: int


@dataclass(frozen=True, slots=True)
class Soak:
    """Results of a service under load.

    Attributes:
        tally: All responses.
        samples: Samples of the whole time.
        rests: Samples at the end of each idle interval.
        log: Log of the service.
    """

    tally: Tally
    samples: Sequence[Sample]
    rests: Sequence[Sample]
    log: str

    @property
    def tracebacks(self) -> int:
        """Number of unhandled errors."""
        return self.log.count("Traceback")

    @property
    def settled_rests(self) -> Sequence[Sample]:
        """Idle intervals after the first quarter, in which modules are loaded and caches fill."""
        return self.rests[int(SETTLED * len(self.rests)) :]


def run(minutes: float = 60.0, seed: int = 1) -> list[Table]:
    """The table ``soak``.

    Args:
        minutes: Duration [min].
        seed: Seed of the actions.
    """
    found = soak(60.0 * minutes, seed)
    for fault in found.tally.faults:
        print(fault)
    if found.tracebacks:
        print(found.log)
    return [tabulate(found)]


def soak(seconds: float, seed: int, spell: float = SPELL, rest: float = REST) -> Soak:
    """Loads a service with the actions of users and others.

    Args:
        seconds: Total duration.
        seed: Seed of the actions.
        spell: Duration of an interval of load [s].
        rest: Duration of the idle interval after it [s].
    """
    rests = []
    with tempfile.TemporaryDirectory() as folder, serve(Path(folder)) as service:
        tally, began = Tally(service.address), time.monotonic()

        def look() -> Sample:
            process, *workers = family_of(service.process.pid)
            return Sample(
                time.monotonic() - began,
                memory_of(process),
                own_memory_of(process),
                sum(map(memory_of, workers)),
                len(list(Path(f"/proc/{process}/fd").iterdir())),
            )

        with watch(look, PERIOD) as samples:
            while time.monotonic() - began < seconds:
                _load(tally, seed + 1000 * len(rests), spell)
                time.sleep(rest)
                rests.append(look())
        return Soak(tally, samples, rests, service.log.read_text(errors="replace"))


def _load(tally: Tally, seed: int, seconds: float) -> None:
    """Runs all users for some time; returns once all have left."""
    researchers = [Researcher(tally, seed + i) for i in range(RESEARCHERS)]
    loiterer, pranks = Loiterer(tally, seed), random.Random(seed)
    users = [("Researcher", each.act) for each in researchers]
    users += [("Loiterer", loiterer.act), ("Prankster", partial(play_prank, tally, pranks))]
    acts = (partial(_act_until, *user, tally, random.Random(seed)) for user in users)
    with background_threads(*acts, partial(visit_until, tally, seed)):
        time.sleep(seconds)
    for each in (*researchers, loiterer):
        each.tidy_up()


def _act_until(
    name: str, act: Callable[[], None], tally: Tally, source: random.Random, ended: threading.Event
) -> None:
    while not ended.wait(source.expovariate(1.0 / PAUSES[name])):
        try:
            act()
        except Exception as error:  # Any error is caused by the service.
            frames = reversed(traceback.extract_tb(error.__traceback__))
            own = next((frame for frame in frames if "soak" in frame.filename), None)
            place = f" in {own.name}, line {own.lineno}" if own else ""
            tally.blame(name, f"{error!r}{place}")


def tabulate(found: Soak) -> Table:
    """Results, compared with the requirements."""
    tally, rests = found.tally, found.settled_rests
    seconds = found.samples[-1].time
    failed = sum(n for (_, ending), n in tally.counts.items() if ending.startswith("5"))
    _, memory, own, workers, descriptors = zip(*rests, strict=True)
    peak = max(sample.service_memory for sample in found.samples)
    rows = (
        ("time", f"{seconds / 60.0:.0f} min", ""),
        ("answers, or connections that ended", f"{tally.total}", ""),
        ("kinds of them", f"{len({kind for kind, _ in tally.counts})}", ""),
        ("not as specified", f"{len(tally.faults)}", "0"),
        ("unhandled errors in the log", f"{found.tracebacks}", "0"),
        ("log", f"{len(found.log) / 1e3:.1f} kB", ""),
        ("answers without 2xx, 3xx or 4xx", f"{failed}", "0"),
        ("memory of the service at rest", _range(memory, 1e6, "MB"), ""),
        ("what it has written itself of that", _range(own, 1e6, "MB"), ""),
        ("slope of that", _slope(rests), "below 1 MB/h"),
        ("memory of its workers at rest", _range(workers, 1e6, "MB"), ""),
        ("largest memory of the service", f"{peak / 1e6:.0f} MB", "1000 MB"),
        ("descriptors of the service at rest", _range(descriptors, 1.0, ""), "always the same"),
    )
    return Table("soak", ("under mixed load", "found", "target"), rows)


def _range(values: Sequence[float], unit: float, name: str) -> str:
    return f"{min(values) / unit:.0f} to {max(values) / unit:.0f} {name}".rstrip()


def _slope(rests: Sequence[Sample]) -> str:
    """Slope of the service's own memory at rest over time, with the error of the fit."""
    times = np.array([rest.time for rest in rests]) / HOUR
    memory = np.array([rest.own_memory for rest in rests]) / 1e6
    if len(rests) < 4:
        return "too short"
    (slope, _), covariance = np.polyfit(times, memory, 1, cov=True)
    return f"{slope:+.1f} ± {np.sqrt(covariance[0, 0]):.1f} MB/h"
