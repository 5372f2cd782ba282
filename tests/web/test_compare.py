"""What tells two runs apart, in words and in a table, and the panel that shows it."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html import unescape
from xml.etree import ElementTree

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.scenario.space import SPATIAL
from slipgrasp.recordings.compare.comparison import compare
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.model.compare_words import amount, column_words, number, scale_of, value_words
from slipgrasp.web.model.intents.compare import SwapRuns
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.pairing import with_ghost
from slipgrasp.web.model.replay import open_replay
from slipgrasp.web.model.run_list import RunList
from slipgrasp.web.model.view import (
    Comparing,
    Ghost,
    RunStage,
    Shown,
    show,
    show_replay,
)
from slipgrasp.web.page.intents_schema import PageGestures
from slipgrasp.web.panels.compare_panel import (
    MOST_PHASE_CHANGES,
    NONE,
    ON_SCREEN,
    ComparePanel,
    compare_html,
    findings_html,
    first_divergence,
)
from tests.web.reducing import first_view

HOSTILE = "<img src=x onerror=alert(1)>"
FINGERS = ("left", "right")


def rows_of(html: str) -> dict[str, list[str]]:
    """The cells of every row of every table, by its head; checks that all is well-formed."""
    tree = ElementTree.fromstring(f"<div>{html.replace('<br>', '<br/>')}</div>")
    rows = [["".join(cell.itertext()) for cell in row] for row in tree.iter("tr")]
    return {row[0]: row[1:] for row in rows}


def intents_of(html: str) -> list[Intent]:
    """What clicks on it ask for, as the page would send it."""
    found = re.findall(r"data-sg-intent=\"([^\"]*)\"", html)
    gestures = [PageGestures.model_validate([json.loads(unescape(text))]) for text in found]
    return [intent for gesture in gestures for intent in gesture.intents()]


def test_numbers_are_written_short_and_with_their_unit() -> None:
    assert [number(v) for v in (0.0, 2.5949, 37.41, 5990.9, -0.1, 1e9)] == [
        "0",
        "2.59",
        "37.4",
        "5991",
        "−0.1",
        "1e+09",
    ]
    assert number(2.0, signed=True) == "+2"
    assert amount(0.0025949, "m") == "2.59 mm"
    assert amount(0.0848, "s") == "84.8 ms"
    assert amount(7.0, "s") == "7 s"
    assert amount(3.2, "m/s²") == "3200 mm/s²"
    assert amount(0.5, "1") == "0.5"
    assert amount(1e-18, "m") == "≈ 0 mm"
    assert amount(-1e-15, "N", signed=True) == "≈ 0 N"
    assert scale_of("s", [0.1, 2.0]).unit == "s"


def test_values_of_parameters_keep_their_digits() -> None:
    assert value_words(1.23456789) == "1.23456789"
    assert value_words((1.0, 0.25)) == "1, 0.25"
    assert [value_words(v) for v in (None, True, "gripper")] == ["–", "yes", "gripper"]


def test_laws_are_compared_by_the_names_of_their_buttons() -> None:
    assert value_words("theorem-3") == "adaptive-mass"


def test_every_column_of_a_run_has_words(case_1: RunResult, sluggish: RunResult) -> None:
    words = [column_words(c, FINGERS) for c in compare(case_1, sluggish).signals.values()]
    assert len(set(words)) == len(words)
    for expected in (
        "object y",
        "tracking error θ",
        "slip velocity right",
        "joint torque left 2",
        "estimate of object mass",
        "true left link mass 1",
        "lyapunov value",
    ):
        assert expected in words


def test_the_table_tells_what_was_set_and_how_both_went(
    case_1: RunResult, sluggish: RunResult
) -> None:
    html = findings_html(compare(case_1, sluggish), FINGERS)
    rows = rows_of(html)
    assert rows["controller Lyapunov weight Q"] == ["20", "1"]
    assert rows["last slip ends [ms]"] == ["87.5", "379", "+292"]
    assert rows["phase changes"] == ["4", "4", ""]
    assert "slip path [mm]" in rows
    assert rows["right ■ → ■"] == ["84.8 ms", "364 ms", "+279 ms"]
    assert re.search(r"slip path \[mm\].*?left.*?2\.59.*?37\.4.*?\+34\.8", html)


def test_a_click_on_a_time_puts_the_play_head_there(case_1: RunResult, sluggish: RunResult) -> None:
    findings = compare(case_1, sluggish)
    times = {
        getattr(intent, "time", None) for intent in intents_of(findings_html(findings, FINGERS))
    }
    assert first_divergence(findings) in times
    assert {change.a for change in findings.phase_changes} <= times


def test_identical_runs_and_those_in_which_the_same_happened_are_told_apart(
    case_1: RunResult,
) -> None:
    assert "Identical" in findings_html(compare(case_1, case_1), FINGERS)
    renamed = replace(case_1, scenario=replace(case_1.scenario, title="other"))
    html = findings_html(compare(case_1, renamed), FINGERS)
    assert "Equal" in html
    assert rows_of(html)["title"] == ["The paper's case I: masses unknown, the…", "other"]


def test_long_lists_of_phase_changes_say_how_many_are_left_out(
    case_1: RunResult, sluggish: RunResult
) -> None:
    findings = compare(case_1, sluggish)
    many = findings.phase_changes * MOST_PHASE_CHANGES
    html = findings_html(replace(findings, phase_changes=many), FINGERS)
    assert f"and {len(many) - MOST_PHASE_CHANGES} more" in html


def test_nothing_from_outside_becomes_markup(case_1: RunResult, sluggish: RunResult) -> None:
    hostile = replace(sluggish, scenario=replace(sluggish.scenario, title=HOSTILE))
    findings = compare(case_1, hostile)
    view = show(first_view(), Shown(1, case_1, 0.0), RunStage.PREVIEW, afresh=True)
    view = replace(
        view,
        ghost=Ghost(Shown(2, hostile, 0.0), HOSTILE),
        comparing=Comparing((1, 2), findings, HOSTILE),
    )
    for html in (findings_html(findings, (HOSTILE, "right")), compare_html(view)):
        assert "<img" not in html
        assert "&lt;img" in html


def test_what_is_known_of_the_pair_before_may_be_about_other_unknowns(
    case_1: RunResult, case_2: RunResult
) -> None:
    other = replace(case_1, scenario=with_values(case_1.scenario, {"estimates.4.initial": 0.7}))
    assert len(case_2.scenario.estimates) == 4
    view = show(first_view(), Shown(3, case_2, 0.0), RunStage.PREVIEW, afresh=True)
    ghost = Ghost(Shown(4, case_2, 0.0), "the run before")
    view = replace(view, ghost=ghost, comparing=Comparing((1, 2), compare(case_1, other)))
    assert "estimate 5 initial" in compare_html(view)


def test_the_panel_offers_the_newest_runs_and_shows_which_are_compared(
    viewer_server: ViewerServer,
    store: RecordingStore,
    stored: tuple[StoredRun, StoredRun],
    case_1: RunResult,
) -> None:
    panel = ComparePanel(viewer_server.gui, lambda _: None)
    view = replace(first_view(), run_list=RunList(recent=stored))
    panel.update(view)
    assert (panel.a.value, panel.b.value) == (ON_SCREEN, NONE)
    assert len(panel.b.options) == 1 + len(stored)
    assert "Compare two runs" in panel.findings.content
    view = show_replay(view, open_replay(store, stored[0].id))
    view = with_ghost(view, open_replay(store, stored[1].id), -1)
    panel.update(view)
    assert panel.a.value.startswith("Q = 20 · held")
    assert panel.b.value.startswith("Q = 1 · held")
    assert "Comparing …" in panel.findings.content
    assert SwapRuns() in intents_of(panel.findings.content)
    unsaved = Ghost(Shown(3, case_1, 0.0), "the run before: this")
    panel.update(replace(view, ghost=unsaved))
    assert (panel.b.value, panel.b.options[1]) == ("the run before: this", NONE)
    panel.update(replace(view, ghost=None, run_list=RunList()))
    assert (panel.b.value, len(panel.a.options)) == (NONE, 2)


def test_beliefs_are_called_by_what_they_are_about(case_1: RunResult) -> None:
    other = replace(case_1, scenario=with_values(case_1.scenario, {"estimates.4.initial": 0.7}))
    findings = compare(case_1, other)
    unknowns = [estimate.parameter for estimate in case_1.scenario.estimates]

    assert "initial estimate of object mass [kg]" in findings_html(findings, FINGERS, unknowns)
    # Where the runs estimate other things, the number alone is common to both.
    assert "estimate 5 initial" in findings_html(findings, FINGERS)


def test_beliefs_and_places_in_space_have_their_names_and_units() -> None:
    held = with_values(load_scenario("spatial-composite"), {"simulation.duration": 0.1})
    other = with_values(
        held, {"estimates.6.initial": 0.1, "fingers.0.base.2": 0.1, "pulses.0.time": 0.05}
    )
    findings = compare(simulate(held), simulate(other))
    unknowns = [estimate.parameter for estimate in held.estimates]
    html = findings_html(findings, held.finger_names, unknowns, SPATIAL)
    assert "initial estimate of object inertia 3 [kg m²]" in html
    assert "base z [m]" in html


def test_what_differs_before_the_cause_is_called_integration_error() -> None:
    calm = with_values(load_scenario("paper-case-2"), {"simulation.duration": 1.0})
    pushed = with_values(calm, {"pulses.0.time": 0.5})

    html = findings_html(compare(simulate(calm), simulate(pushed)), FINGERS)

    assert "are integration error." in html and "They first differ at" in html
    assert "Put the play head at 500 ms" in html
