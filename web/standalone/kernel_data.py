"""What a page needs to run a scenario: the kernel, the scenario as numbers, and words for ends."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.kernel.compilation.webassembly import kept_file
from slipgrasp.core.kernel.loop.status import REACHED
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.schedule import Schedule
from slipgrasp.core.run.verdict import headline_of_end
from slipgrasp.core.scenario import PlanarScenario, Scenario
from slipgrasp.core.scenario.chosen_laws import custom_law_in
from slipgrasp.core.scenario.table import place_of
from slipgrasp.core.trace.trace import SIGNALS
from slipgrasp.core.trace.types import Outcome
from slipgrasp.core.words.endings import end_blanks, end_words

ENTRIES = ("slipgrasp_pack", "slipgrasp_begin_run", "slipgrasp_advance")
"""The units that a page calls."""


class PageError(SlipgraspError):
    """A scenario that a page cannot simulate."""


def kernel_file() -> bytes:
    """The kernel of planar hands as a WebAssembly file.

    Raises:
        LinkError: If it has to be linked and the linker is missing.
    """
    return kept_file(ENTRIES).read_bytes()


def check_for_page(scenario: Scenario) -> PlanarScenario:
    """The scenario, if a page can simulate it.

    Raises:
        PageError: If it cannot.
    """
    if not isinstance(scenario, PlanarScenario):
        raise PageError("a page simulates planar hands only, not yet spatial ones")
    if custom_law_in(scenario) is not None:
        raise PageError("a page has the built-in control laws only, no custom law")
    if scenario.patches:
        raise PageError("a page cannot simulate low-friction patches yet")
    if any(change.parameter.startswith("estimates.") for change in scenario.changes):
        raise PageError("a page cannot change estimates during a run yet")
    return scenario


def run_data(result: RunResult) -> dict[str, Any]:
    """Segments of the run, columns of its rows, and what its end is called, as plain values."""
    scenario, shape = check_for_page(result.scenario), result.trace.shape
    segments = list(segments_of(scenario))
    widths = [shape.widths[signal.per] for signal in SIGNALS]
    starts = np.cumsum([0, *widths[:-1]]).tolist()
    return {
        "table": _encoded(segments[0].table),
        "segments": [
            {
                "end": segment.end,
                "load": segment.load,
                "changes": _differences(segments[0].table, segment.table),
            }
            for segment in segments
        ],
        "period": place_of("controller.control_period"),
        "columns": {
            signal.name: [start, width]
            for signal, start, width in zip(SIGNALS, starts, widths, strict=True)
        },
        "num_columns": shape.num_columns,
        "fingers": scenario.finger_names,
        "ends": _ends(),
        "blanks": end_blanks(scenario),
        "duration": scenario.simulation.duration,
    }


class Segment(NamedTuple):
    """A part of a run in which all constants stay the same.

    Attributes:
        end: When it ends [s].
        load: Force and moment of the pulses that act [N, N, N m].
        table: The numbers of the scenario.
    """

    end: float
    load: list[float]
    table: NDArray[np.float64]


def segments_of(scenario: PlanarScenario) -> Iterator[Segment]:
    """The segments of a run without patches."""
    schedule = Schedule(scenario)
    rest = np.zeros(len(scenario.fingers))
    while True:
        table = np.frombuffer(schedule.table.tobytes(), "<f8")
        yield Segment(schedule.stretch_end, schedule.load().tolist(), table)
        if schedule.is_last:
            return
        schedule.pass_instant(rest, rest)


def _differences(first: np.ndarray, table: np.ndarray) -> dict[int, float]:
    same = (first == table) | (np.isnan(first) & np.isnan(table))
    return {int(place): float(table[place]) for place in np.flatnonzero(~same)}


def _ends() -> dict[int, dict[str, str]]:
    """Outcome, headline and sentence of every status in which a run ends."""
    ends = {
        status: {
            "outcome": words.outcome,
            "headline": headline_of_end(Outcome(words.outcome), words.code),
            "sentence": words.sentence,
        }
        for status, words in end_words().items()
    }
    completed = {"outcome": Outcome.COMPLETED.value, "headline": "Completed", "sentence": ""}
    return {REACHED: completed, **ends}


def _encoded(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values, "<f8").tobytes()).decode()
