"""Data of a page that runs a scenario: kernel, scenario as numbers, and text of endings."""

from __future__ import annotations

import base64
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.status import REACHED
from slipgrasp.core.kernel.webassembly.build import ADVANCE, SPATIAL_ADVANCE, kept_file
from slipgrasp.core.run.engine import engine_of, make_engine
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.schedule import Schedule, Timetable
from slipgrasp.core.run.verdict import headline_of_end, headline_of_hold
from slipgrasp.core.scenario import PlanarScenario, Scenario
from slipgrasp.core.scenario.chosen_laws import custom_law_in
from slipgrasp.core.scenario.scenario import is_acting
from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.core.trace.types import Outcome
from slipgrasp.core.words.endings import end_blanks, end_words
from slipgrasp.recordings.study.categories import category_of

_ENTRIES = ("slipgrasp_pack", "slipgrasp_begin_run", ADVANCE)
"""Units called by the page of a planar hand."""


_linking = threading.Lock()
"""Two sessions may request the file at the same time."""


class PageError(SlipgraspError):
    """A scenario that a page cannot simulate."""


def kernel_file(scenario: Scenario) -> bytes:
    """The kernel of the hand of a scenario as a WebAssembly file.

    Raises:
        LinkError: If it must be linked and the linker is missing.
    """
    engine_of(scenario.space)
    is_planar = isinstance(scenario, PlanarScenario)
    with _linking:
        return kept_file(_ENTRIES if is_planar else (SPATIAL_ADVANCE,)).read_bytes()


def check_for_page(result: RunResult) -> None:
    """Rejects a run that a page cannot simulate or show.

    Raises:
        PageError: If the scenario is not supported.
    """
    scenario = result.scenario
    if not scenario.space.has_hand:
        raise PageError(
            f"pages simulate hands, but this is a body on a {scenario.space.name}; open its "
            "recording instead: "
            "slipgrasp replay RUN"
        )
    if result.trace.absent:
        raise PageError("the recording is of an older format: simulate its scenario again first")
    if custom_law_in(scenario) is not None:
        raise PageError("pages support only the built-in control laws, not custom laws")
    if scenario.patches:
        raise PageError("pages do not support low-friction patches yet")
    if any(change.parameter.startswith("estimates.") for change in scenario.changes):
        raise PageError("pages do not support changes of estimates during a run yet")


def run_data(result: RunResult) -> dict[str, Any]:
    """Segments of the run, columns of its rows, and text of its endings, as plain values."""
    scenario, shape = result.scenario, result.trace.shape
    widths = [shape.widths[signal.per] for signal in SIGNALS]
    starts = np.cumsum([0, *widths[:-1]]).tolist()
    return {
        "scenario": _planar(scenario) if isinstance(scenario, PlanarScenario) else _packed(result),
        "columns": {
            signal.name: [start, width]
            for signal, start, width in zip(SIGNALS, starts, widths, strict=True)
        },
        "num_columns": shape.num_columns,
        "fingers": scenario.finger_names,
        "ends": _ends(),
        "holds": _holds(),
        "blanks": end_blanks(scenario),
        "duration": scenario.simulation.duration,
    }


def _planar(scenario: PlanarScenario) -> dict[str, Any]:
    """A planar scenario as its table, and the changes in each segment."""
    schedule, segments = Schedule(scenario), []
    rest = np.zeros(len(scenario.fingers))
    first = np.frombuffer(schedule.table.tobytes(), "<f8")
    while True:
        table = np.frombuffer(schedule.table.tobytes(), "<f8")
        changes = _differences(first, table)
        load = schedule.load().tolist()
        segments.append({"end": schedule.stretch_end, "load": load, "changes": changes})
        if schedule.is_last:
            return {"table": encoded(first), "segments": segments}
        schedule.pass_instant(rest, rest)


def _packed(result: RunResult) -> dict[str, Any]:
    """A spatial scenario as records: the run at its start, and the model of each segment."""
    engine, segments = make_engine(result.scenario, keeps_rows=True), []
    while True:
        model = engine.pack()
        segments.append(
            {
                "end": engine.timetable.stretch_end,
                "model": encoded(bytes_of(model)),
                "period": float(model.law.period),
            }
        )
        if engine.timetable.is_last:
            run, columns = encoded(bytes_of(engine.run)), result.trace.shape.num_columns
            return {"run": run, "columns": columns, "segments": segments}
        engine.pass_instant()


def bytes_of(record: Record) -> NDArray[np.uint8]:
    """Bytes of a record, as a view."""
    return np.frombuffer(record, np.uint8)


def loads_of(scenario: Scenario) -> Iterator[tuple[float, list[float]]]:
    """Segments of a run without patches: end [s], and force and moment of pulses [N, N m]."""
    timetable: Timetable[Any] = Timetable(scenario)
    size = 3 if isinstance(scenario, PlanarScenario) else 6
    while True:
        load = np.zeros(size)
        for pulse in timetable.present.pulses:
            if is_acting(pulse, timetable.begin):
                load += np.append(pulse.force, pulse.moment)
        yield timetable.stretch_end, load.tolist()
        if timetable.is_last:
            return
        timetable.end_stretch()


def _differences(first: np.ndarray, table: np.ndarray) -> dict[int, float]:
    same = (first == table) | (np.isnan(first) & np.isnan(table))
    return {int(place): float(table[place]) for place in np.flatnonzero(~same)}


def _ends() -> dict[int, dict[str, str]]:
    """Outcome, headline and sentence for every final status of a run."""
    ends = {
        status: {
            "outcome": words.outcome,
            "headline": headline_of_end(Outcome(words.outcome), words.code),
            "sentence": words.sentence,
            "category": category_of(words.outcome, words.code),
        }
        for status, words in end_words().items()
    }
    completed = {"outcome": Outcome.COMPLETED.value, "headline": "Completed", "sentence": ""}
    return {REACHED: completed, **ends}


def _holds() -> dict[str, str]:
    """Headlines of completed runs, by the names in ``worker.js``."""
    return {
        "held": headline_of_hold(True, slipping=False),
        "tooShort": headline_of_hold(None, slipping=False),
        "settling": headline_of_hold(False, slipping=False),
        "slipping": headline_of_hold(False, slipping=True),
    }


def encoded(array: NDArray[Any]) -> dict[str, str]:
    """Encodes an array for the scripts of the page."""
    content = np.ascontiguousarray(array)
    return {"$": content.dtype.str, "b": base64.b64encode(content.tobytes()).decode()}
