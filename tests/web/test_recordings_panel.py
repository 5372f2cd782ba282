"""The list of stored runs as it is shown."""

from __future__ import annotations

import re
from dataclasses import replace
from html import escape

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.store.store import RecordingStore, StoredRun
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.run_list import Notice, RunFilter, RunList
from slipgrasp.web.panels.recordings_panel import (
    RecordingsPanel,
    chosen_html,
    distinct_names,
    row_words,
    rows_html,
)
from tests.web.reducing import first_view

HOSTILE = "<img src=x onerror=alert(1)>"


def test_a_row_says_how_a_run_went(store: RecordingStore, case_1: RunResult) -> None:
    stored = store.save(case_1)
    words = row_words(stored)
    assert (words.label, words.outcome, words.tone) == ("paper-case-1", "held", "good")
    assert re.fullmatch(r"7 s · slip 2\.6 mm · \d{4}-\d\d-\d\d \d\d:\d\d", words.details)
    assert words.unknown == "unknown: mass, link masses"
    ended = {**stored.summary, "outcome": "left_face"}
    assert row_words(replace(stored, summary=ended)).outcome == "left face"
    slipping = {**stored.summary, "metrics": {**stored.summary["metrics"], "held": False}}
    assert row_words(replace(stored, summary=slipping)).outcome == "not held"
    assert row_words(replace(stored, name="mine")).label == "mine"


def test_a_run_of_which_nothing_can_be_read_is_called_unreadable(
    store: RecordingStore, case_1: RunResult
) -> None:
    words = row_words(replace(store.save(case_1), summary={}))
    assert (words.outcome, words.tone) == ("unreadable", "bad")


def test_the_list_marks_what_is_chosen_and_what_is_on_the_screen(
    store: RecordingStore, case_1: RunResult
) -> None:
    runs = tuple(store.save(case_1) for _ in range(2))
    html = rows_html(RunList(0, 2, runs, chosen_id=runs[0].id), runs[1].id)
    assert html.count("sg-chosen") == html.count("sg-open") == 1
    assert html.index("sg-chosen") < html.index("sg-open")
    assert html.count("on screen") == 1
    assert "1 to 2 of 2 stored runs" in html
    assert "list-recordings" not in html
    middle = rows_html(RunList(1, 25, runs, RunFilter("q")), "")
    assert "13 to 14 of 25 matching runs" in middle
    assert middle.count("list-recordings") == 2


def test_nothing_that_is_stored_becomes_markup(store: RecordingStore, case_1: RunResult) -> None:
    stored = store.save(case_1)
    run = replace(stored, title=HOSTILE, name=HOSTILE, notes=HOSTILE, tags=(HOSTILE,))
    run_list = RunList(0, 2, (run, replace(run, summary={})), notice=Notice("Not opened", HOSTILE))
    for html in (rows_html(run_list, ""), chosen_html(run)):
        assert "<img" not in html
        assert "&lt;img" in html


class RecordedIntents(list[Intent]):
    """Takes intents, and keeps them."""

    def send(self, intent: Intent) -> None:
        self.append(intent)


def test_what_is_being_written_about_a_run_stays_while_the_list_is_looked_up_again(
    viewer_server: ViewerServer, store: RecordingStore, case_1: RunResult
) -> None:
    run = store.save(case_1)
    panel = RecordingsPanel(viewer_server.gui, RecordedIntents().send)
    panel.update(first_view(run_list=RunList(0, 1, (run,), chosen_id=run.id, chosen=run)))
    panel.chosen.name.value = "half a na"
    panel.update(first_view(run_list=RunList(0, 2, (run, run), chosen_id=run.id, chosen=run)))
    assert panel.chosen.name.value == "half a na"
    renamed = replace(run, name="by someone else")
    panel.update(first_view(run_list=RunList(0, 2, (run, run), chosen_id=run.id, chosen=renamed)))
    assert panel.chosen.name.value == "by someone else"


def test_runs_of_one_name_are_told_apart_by_when_they_were_saved(
    store: RecordingStore, case_1: RunResult
) -> None:
    stored: StoredRun = store.save(case_1)
    runs = [
        replace(stored, id=f"{n:012}", created=f"2026-11-22T10:05:{second:02}.000+00:00", name=name)
        for n, (second, name) in enumerate(
            [(1, ""), (2, ""), (2, "mine"), (3, "mine"), (3, "mine")]
        )
    ]

    names = list(distinct_names(runs).values())

    assert names[:2] == [f"{stored.display_name} · 10:05:01", f"{stored.display_name} · 10:05:02"]
    assert names[2:] == ["mine · 10:05:02", f"mine · {runs[3].id}", f"mine · {runs[4].id}"]
    assert distinct_names(runs[:1]) == {runs[0].id: stored.display_name}


def test_a_row_shows_the_display_name_and_not_the_title_of_its_preset(
    store: RecordingStore, case_1: RunResult
) -> None:
    stored = store.save(case_1)
    shown = rows_html(RunList(runs=(stored,), count=1), "")

    assert escape(stored.display_name) in shown
    assert escape(stored.title) not in shown
