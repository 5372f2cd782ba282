"""The stored runs: a page of them, each a button that opens it."""

from __future__ import annotations

from html import escape
from typing import Any, NamedTuple

import viser

from core.types import Outcome
from recordings.store import StoredRun
from web.colours import tone
from web.intents.intent import Send
from web.intents.recordings import ListRecordings, OpenRecording
from web.librarian import ROWS_PER_PAGE
from web.panels.outcome_panel import box_html
from web.replay import moment_words
from web.view import Shelf, ViewState

__all__ = ["RecordingsPanel", "RowWords", "row_words"]

_NEWER, _OLDER, _REFRESH = "newer", "older", "refresh"
_LONGEST_LABEL = 30


class RowWords(NamedTuple):
    """What the list says about a stored run: its name, and how it went."""

    label: str
    outcome: str
    tone: str
    details: str


class RecordingsPanel:
    """Lists the stored runs, newest first.

    Args:
        gui: Where it goes.
        send: Takes the intents.

    Attributes:
        head: Which runs are listed, and why the last one could not be opened.
        rows: The runs of the page.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        self.head = gui.add_html("")
        self._pages = gui.add_button_group("page", (_NEWER, _OLDER, _REFRESH))
        self._pages.on_click(lambda _: send(ListRecordings(self._page_of(self._pages.value))))
        self.rows = [_Row(gui, send) for _ in range(ROWS_PER_PAGE)]
        self._shelf: Shelf | None = None
        self._open_id = ""

    def update(self, view: ViewState) -> None:
        """Shows a page of the list, and which run is on the screen."""
        replay = view.shown.replay if view.shown else None
        open_id = replay.run_id if replay else ""
        if (view.shelf, open_id) == (self._shelf, self._open_id):
            return
        self._shelf, self._open_id = view.shelf, open_id
        self.head.content = _head_html(view.shelf)
        runs = view.shelf.runs
        for i, row in enumerate(self.rows):
            row.show(runs[i] if i < len(runs) else None, open_id)

    def remove(self) -> None:
        """Takes everything off the page."""
        self.head.remove()
        self._pages.remove()
        for row in self.rows:
            row.remove()

    def _page_of(self, button: str) -> int:
        """The page that a button asks for; one beyond the last is answered with the last."""
        page = self._shelf.page if self._shelf else 0
        return max(page + {_NEWER: -1, _OLDER: 1}.get(button, 0), 0)


class _Row:
    """One stored run: a button with its name, and a line below that says how it went."""

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._run_id = ""
        self.button = gui.add_button("", visible=False)
        self.line = gui.add_html("", visible=False)
        self.button.on_click(lambda _: send(OpenRecording(self._run_id)))

    def show(self, run: StoredRun | None, open_id: str) -> None:
        """Shows a run; without one it hides."""
        self.button.visible = self.line.visible = run is not None
        if run is None:
            return
        words = row_words(run)
        self._run_id = run.id
        self.button.label = words.label
        self.button.hint = f"Open {run.id}: {run.title}"
        self.button.color = None if run.id == open_id else "gray"
        self.line.content = _line_html(words)

    def remove(self) -> None:
        """Takes the row off the page."""
        self.button.remove()
        self.line.remove()


def row_words(run: StoredRun) -> RowWords:
    """What the list says about a run; of an unreadable one its title tells why."""
    try:
        outcome, tone_name = _outcome_words(run.summary)
        slip = 1e3 * max(run.summary["metrics"]["slip_path"])
        end = f"{run.summary['end_time']:g} s"
    except (KeyError, TypeError, ValueError):
        # What lies beside a recording may have been written by anyone.
        return RowWords(_shortened(run.name or run.id), "unreadable", "bad", run.title)
    details = f"{end} · slip {slip:.1f} mm · {moment_words(run.created)}"
    return RowWords(_shortened(run.name or run.preset or run.title), outcome, tone_name, details)


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST_LABEL else f"{text[: _LONGEST_LABEL - 1].rstrip()}…"


def _outcome_words(summary: dict[str, Any]) -> tuple[str, str]:
    outcome = str(summary["outcome"])
    if outcome != Outcome.COMPLETED:
        return outcome.replace("_", " "), "bad"
    return ("held", "good") if summary["metrics"]["held"] else ("not held", "warning")


def _head_html(shelf: Shelf) -> str:
    first = shelf.page * ROWS_PER_PAGE + 1
    last = shelf.page * ROWS_PER_PAGE + len(shelf.runs)
    range_words = f"{first} to {last} of {shelf.count} stored runs, newest first"
    words = range_words if shelf.runs else "No stored runs yet: whatever rests is saved."
    message = box_html("Not opened", [escape(shelf.message)]) if shelf.message else ""
    return f"<div style='padding:0.5em 0.75em 0;font-size:0.85em'>{message}{words}</div>"


def _line_html(words: RowWords) -> str:
    return (
        "<div style='padding:0 0.75em 0.5em;font-size:0.78em;font-variant-numeric:tabular-nums'>"
        f"<b style='color:{tone(words.tone)}'>{escape(words.outcome)}</b> "
        f"<span style='opacity:0.75'>{escape(words.details)}</span></div>"
    )
