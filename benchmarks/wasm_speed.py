"""Size and speed of the kernel as WebAssembly, compared with native code."""

from __future__ import annotations

import gzip
import time
from collections.abc import Mapping
from pathlib import Path

from benchmarks.engines import STEPS, Engine
from benchmarks.report import PORTABILITY, Table
from benchmarks.timing import MILLISECONDS
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.output import rows_in
from slipgrasp.core.kernel.loop.status import RUNNING
from slipgrasp.core.kernel.planar.advance import advance_run
from slipgrasp.core.kernel.planar.packing import make_table, pack_model, whole_faces
from slipgrasp.core.kernel.planar.run import make_run
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values

ROUNDS = 200
NATIVE = "native"
# Control period and duration [s]: short, so that other processes rarely interrupt them.
CASES = {
    "7 s of case I, continuous control": (0.0, 7.0),
    "1 s of case I, 1 kHz control": (0.001, 1.0),
}


def compare_engines(engines: Mapping[str, Engine], path: Path, rounds: int = ROUNDS) -> Table:
    """The table ``webassembly``: smallest wall time of a run in every engine, in turns.

    Args:
        engines: Engines that run the file.
        path: Path of the file.
        rounds: Number of timings of each run.
    """
    rows = []
    for words, (period, duration) in CASES.items():
        values = {"controller.control_period": period, "simulation.duration": duration}
        scenario = with_values(load_scenario("paper-case-1"), values)
        least = _least_seconds(engines, scenario, rounds)
        own = least[NATIVE]
        cells = [f"{MILLISECONDS * own:.2f}"]
        cells += [f"{MILLISECONDS * least[name]:.2f} ({least[name] / own:.2f})" for name in engines]
        rows.append((words, *cells))
    content = path.read_bytes()
    note = (
        f"Packing, stepping and copying rows: least of {rounds} times in turns [ms], in brackets "
        f"relative to native code. The file has {len(content) / 1e3:.0f} kB, "
        f"{len(gzip.compress(content)) / 1e3:.0f} kB compressed."
    )
    return Table("webassembly", ("run", NATIVE, *engines), tuple(rows), (note,), PORTABILITY)


def _least_seconds(
    engines: Mapping[str, Engine], scenario: Scenario, rounds: int
) -> dict[str, float]:
    table, end = make_table(scenario), scenario.simulation.duration
    works = {name: engine.seconds_of_run for name, engine in engines.items()}
    works[NATIVE] = _seconds_natively
    turns = [{name: work(table, end) for name, work in works.items()} for _ in range(rounds)]
    return {name: min(turn[name] for turn in turns) for name in works}


def _seconds_natively(table: Record, end: float) -> float:
    start = time.perf_counter()
    model = pack_model(table, whole_faces())
    run, outlet = make_run(table, keeps_rows=True)
    rows, status = [], RUNNING
    while status == RUNNING:
        status = advance_run(model, run, outlet, end, first=True, same_ticks=False, max_steps=STEPS)
        rows.append(rows_in(outlet, int(run.row.length)).copy())
        outlet.num_rows = outlet.num_ticks = run.num_changes = 0
    return time.perf_counter() - start
