"""The phase strip, as plain HTML."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import PHASES
from slipgrasp.web.charts.charts import contact_charts
from slipgrasp.web.model.colours import css
from slipgrasp.web.model.playback import Playback, TimeWindow, slip_window
from slipgrasp.web.model.view import Ghost, Shown
from slipgrasp.web.panels.strip import axis_ticks, phase_spans, strip_html


def playback(result: RunResult) -> Playback:
    window = slip_window(result)
    return Playback(time=window.start, window=window, speed=0.5, playing=False)


def test_spans_cover_the_window_in_the_phases_of_the_trace(case_2: RunResult) -> None:
    window = slip_window(case_2)
    spans = list(phase_spans(case_2, 0, window, cells=100))
    assert sum(length for _, length, _ in spans) == 100
    assert [start for start, _, _ in spans[1:]] == [s + n for s, n, _ in spans[:-1]]
    for start, length, phase in spans:
        middle = window.start + (start + 0.5 * length) / 100 * window.length
        row = np.searchsorted(case_2.trace.times, middle, side="right") - 1
        assert case_2.trace.phase[row, 0] == phase


def test_no_phase_is_shown_after_the_end_of_a_run(case_2: RunResult) -> None:
    ended = replace(case_2, trace=case_2.trace[case_2.trace.times < 0.05])
    spans = list(phase_spans(ended, 0, TimeWindow(0.0, 0.2), cells=100))
    assert {phase for _, _, phase in spans} == {ContactPhase.SLIP_FORWARD}
    assert 23 <= sum(length for _, length, _ in spans) <= 26
    assert list(phase_spans(ended, 0, TimeWindow(0.1, 0.2))) == []


def test_a_slip_shorter_than_a_cell_is_still_seen(case_1: RunResult) -> None:
    phase = np.zeros_like(case_1.trace.phase)
    row = int(np.searchsorted(case_1.trace.times, 3.0))
    phase[row, 1] = ContactPhase.SLIP_BACKWARD
    blip = replace(case_1, trace=replace(case_1.trace, phase=phase))
    spans = list(phase_spans(blip, 1, TimeWindow(0.0, 7.0), cells=50))
    assert [phase for _, _, phase in spans].count(ContactPhase.SLIP_BACKWARD) == 1
    assert {phase for _, _, phase in phase_spans(blip, 0, TimeWindow(0.0, 7.0))} == {0}


@pytest.mark.parametrize(
    ("start", "end", "labels", "unit"),
    [
        (0.0, 0.16, ["0", "50", "100", "150"], "ms"),
        (0.0, 7.0, ["0", "2", "4", "6"], "s"),
        (2.0, 2.4, ["2.0", "2.1", "2.2", "2.3", "2.4"], "s"),
        (0.0123, 0.0133, ["12.4", "12.6", "12.8", "13.0", "13.2"], "ms"),
    ],
)
def test_ticks_stand_at_round_times(start: float, end: float, labels: list, unit: str) -> None:
    ticks, found = axis_ticks(TimeWindow(start, end))
    assert ([tick.label for tick in ticks], found) == (labels, unit)
    scale = 1e3 if unit == "ms" else 1.0
    for tick in ticks:
        assert start + tick.share * (end - start) == pytest.approx(float(tick.label) / scale)


def test_the_strip_has_a_lane_per_contact_and_a_mark_per_event(case_2: RunResult) -> None:
    root = ElementTree.fromstring(strip_html(case_2, playback(case_2), None))
    assert len(root.findall(".//svg[@class='sg-lane']")) == 2
    assert css(PHASES[ContactPhase.SLIP_FORWARD]) in {r.get("fill") for r in root.iter("rect")}
    told = "\n".join(mark.get("title", "") for mark in root.findall(".//span[@class='sg-mark']"))
    assert "left starts to slip up" in told and "right sticks again" in told
    lines = {line.label: line.colour for line in contact_charts(case_2)[0].lines}
    names = root.findall(".//div[@class='sg-names']/span[@style]")
    assert [name.text for name in names] == list(lines)
    for name in names:
        assert css(lines[str(name.text)]) in name.get("style", "")


def test_crowded_events_share_a_mark_that_tells_how_many_there_are(case_2: RunResult) -> None:
    crowd = replace(case_2, phase_changes=case_2.phase_changes * 500)
    root = ElementTree.fromstring(strip_html(crowd, playback(crowd), None))
    marks = root.findall(".//span[@class='sg-mark']")
    assert len(marks) < 100
    assert any("more" in mark.get("title", "") for mark in marks)


def test_the_pale_run_has_a_thin_lane_below_each_lane(case_1: RunResult, case_2: RunResult) -> None:
    ghost = Ghost(Shown(2, case_1, 0.0), "the run before")
    with_ghost = ElementTree.fromstring(strip_html(case_2, playback(case_2), ghost))
    assert len(with_ghost.findall(".//svg[@class='sg-ghost-lane']")) == 2
    without = strip_html(case_2, playback(case_2), None)
    assert "sg-ghost-lane" not in without
