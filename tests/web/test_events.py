"""What happens in a run, as moments on its time line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Change
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import Outcome
from slipgrasp.web.model.events import EventKind, events_of, neighbouring_event_time


@pytest.fixture(scope="module")
def changed() -> RunResult:
    """A run whose object becomes heavier at half a second, and which ends soon after."""
    scenario = with_values(load_scenario("paper-case-1"), {"simulation.duration": 1.0})
    return simulate(
        replace(scenario, changes=(Change(time=0.5, parameter="object.mass", value=1.1),))
    )


def test_every_phase_change_is_an_event_at_its_time(case_2: RunResult) -> None:
    events = [e for e in events_of(case_2) if e.kind in (EventKind.SLIP, EventKind.STICK)]
    assert [e.time for e in events] == [change.time for change in case_2.phase_changes]
    assert [e.phase for e in events] == [change.to_phase for change in case_2.phase_changes]
    assert "left starts to slip up" in {e.text for e in events}
    assert "right sticks again" in {e.text for e in events}


def test_a_timed_change_and_the_end_are_events_in_time_order(changed: RunResult) -> None:
    events = events_of(changed)
    assert [e.time for e in events] == sorted(e.time for e in events)
    (change,) = [e for e in events if e.kind is EventKind.CHANGE]
    assert (change.time, change.text) == (0.5, "object mass becomes 1.1")
    assert (events[-1].kind, events[-1].time) == (EventKind.END, 1.0)
    assert events[-1].text == "the run is complete"


def test_a_run_that_ends_early_tells_why(case_1: RunResult) -> None:
    stopped = replace(case_1, outcome=Outcome.STOPPED)
    assert events_of(stopped)[-1].text == "the run ends: stopped"


def test_jumps_visit_every_event_once_and_stop_at_the_ends(changed: RunResult) -> None:
    expected = np.unique([0.0, *(e.time for e in events_of(changed))])
    visited = [0.0]
    while neighbouring_event_time(changed, visited[-1], 1) > visited[-1]:
        visited.append(neighbouring_event_time(changed, visited[-1], 1))
    assert visited == list(expected)
    for later, earlier in zip(visited[:0:-1], visited[-2::-1], strict=True):
        assert neighbouring_event_time(changed, later, -1) == earlier
    assert neighbouring_event_time(changed, 0.0, -1) == 0.0
