"""The panel of stored runs: a page of the list, and actions on the selected run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from html import escape
from typing import Any, NamedTuple

import viser

from slipgrasp.core.trace.types import Outcome
from slipgrasp.core.words.knowledge_words import list_unknowns
from slipgrasp.recordings.export import DATA_FORMATS
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.server.addresses import API_PATH, UPLOAD_PATH, from_page
from slipgrasp.web.model.colours import tone
from slipgrasp.web.model.intents.compare import CompareRuns
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.recordings import (
    AnnotateRecording,
    ChooseRecording,
    DeleteRecording,
    FilterRecordings,
    ListRecordings,
    OpenRecording,
)
from slipgrasp.web.model.replay import moment_words
from slipgrasp.web.model.run_list import OUTCOME_CHOICES, ROWS_PER_PAGE, RunList
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.page.markup import clickable
from slipgrasp.web.panels.outcome_panel import box_html

_OPEN = "Open for replay"
_LINKS = (
    ("recording", "MCAP"),
    *((f"signals.{each.name}", each.title) for each in DATA_FORMATS if each.is_listed),
)


class RecordingsPanel:
    """Lists the stored runs, newest first, and edits the selected one.

    Args:
        gui: Parent of the widgets.
        send: Accepts the intents.

    Attributes:
        rows: The page of the list.
        chosen: The actions on the selected run.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._gui, self._send = gui, send
        self._text = gui.add_text(
            "find", "", hint="Lists runs with this text in their title, name or notes."
        )
        self._outcome = gui.add_dropdown(
            "outcome", OUTCOME_CHOICES, hint="Lists only runs with this outcome."
        )
        for widget in (self._text, self._outcome):
            widget.on_update(self._filter)
        self.rows = gui.add_html("")
        self.chosen = _ChosenRun(gui, send)
        gui.add_html(upload_html())
        self._run_list: RunList | None = None
        self._open_id = ""

    def update(self, view: ViewState) -> None:
        """Shows a page of the list, and marks the selected run and the run on the screen."""
        replay = view.shown.replay if view.shown else None
        open_id = replay.run_id if replay else view.status.run_id
        if (view.run_list, open_id) == (self._run_list, self._open_id):
            return
        self._run_list, self._open_id = view.run_list, open_id
        self.rows.content = rows_html(view.run_list, open_id)
        self.chosen.show(view.run_list.chosen)

    async def _filter(self, event: viser.GuiEvent[Any]) -> None:
        # Runs in the viewer server's event loop, which keeps the order of inputs.
        if event.client_id is not None:
            self._send(FilterRecordings(self._text.value, self._outcome.value))


class _ChosenRun:
    """Opens, compares, renames, tags and deletes a stored run; hidden without a selection.

    Args:
        gui: Parent of the widgets.
        send: Accepts the intents.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._gui, self._send = gui, send
        self._run: StoredRun | None = None
        self.folder = gui.add_folder("Chosen run", visible=False)
        with self.folder:
            self.words = gui.add_html("")
            self.open = gui.add_button(
                _OPEN,
                icon=viser.Icon.PLAYER_PLAY,
                hint="Shows this run on the screen, exactly as recorded.",
            )
            self.compare = gui.add_button(
                "Compare with the screen",
                icon=viser.Icon.ARROWS_DIFF,
                color="gray",
                hint="Draws this run pale below the one on the screen; see the Compare tab.",
            )
            self._add_form()
            self.delete = gui.add_button(
                "Delete …",
                icon=viser.Icon.TRASH,
                color="red",
                hint="Deletes this run and its notes permanently, after a confirmation.",
            )
        self.open.on_click(self._open)
        self.compare.on_click(self._compare)
        self.delete.on_click(self._ask)

    def _add_form(self) -> None:
        with self._gui.add_form("Name and tags", expand_by_default=False) as self.form:
            self.name = self._gui.add_text(
                "name", "", hint="Name of the run; at most 200 characters. Enter saves it."
            )
            self.tags = self._gui.add_text(
                "tags", "", hint="Tags, separated by commas. Enter saves them."
            )
            self.notes = self._gui.add_text(
                "notes", "", multiline=True, hint="Notes about the run."
            )
            self.save = self._gui.add_button(
                "Save", color="gray", hint="Stores name, tags and notes with the recording."
            )
        self.save.on_click(lambda _: self.form.submit())
        self.form.on_submit(self._annotate)

    def show(self, run: StoredRun | None) -> None:
        """Shows a run; text that the user is editing stays unless it was changed elsewhere."""
        before, self._run = self._run, run
        self.folder.visible = run is not None
        if run is None or run == before:
            return
        self.words.content = chosen_html(run)
        self.open.label = "Draw over the run" if run.is_measured else _OPEN
        self.compare.visible = not run.is_measured
        if before is None or run.id != before.id or run.annotations != before.annotations:
            self.name.value = run.name
            self.tags.value = ", ".join(run.tags)
            self.notes.value = run.notes

    async def _open(self, _: object) -> None:
        if self._run is not None:
            # Measured data have no hand of their own: they are laid over the run on the screen.
            is_measured = self._run.is_measured
            self._send(
                CompareRuns("", self._run.id) if is_measured else OpenRecording(self._run.id)
            )

    async def _compare(self, _: object) -> None:
        if self._run is not None:
            self._send(CompareRuns("", self._run.id))

    async def _annotate(self, _: object) -> None:
        if (run := self._run) is not None:
            name, tags, notes = self.name.value, self.tags.value, self.notes.value
            self._send(AnnotateRecording(run.id, run.revision, name, tags, notes))

    async def _ask(self, _: object) -> None:
        if (run := self._run) is not None:
            words = row_words(run)
            ask_to_confirm(
                self._gui,
                "Delete this run permanently?",
                (words.label, f"{run.id} · {words.outcome} · {words.details}"),
                "Delete",
                lambda: self._send(DeleteRecording(run.id, run.revision)),
            )


class RowWords(NamedTuple):
    """The text of a stored run in the list: name, outcome, unknown parameters."""

    label: str
    outcome: str
    tone: str
    details: str
    unknown: str = ""


def distinct_names(runs: Sequence[StoredRun]) -> dict[str, str]:
    """Names of runs in a list, by id; equal names get the time of saving."""
    told = [(run.display_name, _timed_name(run), f"{run.display_name} · {run.id}") for run in runs]
    counts = Counter(name for names in told for name in set(names))
    return {
        run.id: next((name for name in names if counts[name] == 1), names[-1])
        for run, names in zip(runs, told, strict=True)
    }


def _timed_name(run: StoredRun) -> str:
    """The name of a run, and the time at which it was saved."""
    return f"{run.display_name} · {run.created[11:19]}"


def row_words(run: StoredRun) -> RowWords:
    """The outcome of a run in the list; the title of an unreadable one says why."""
    if run.is_measured:
        return RowWords(run.display_name, "measured", "good", run.title)
    if not run.summary:
        return RowWords(run.display_name, "unreadable", "bad", run.title)
    outcome, tone_name = _outcome_words(run.summary)
    slip = 1e3 * max(run.summary["metrics"]["slip_path"])
    end = f"{run.summary['end_time']:.4g} s"
    details = f"{end} · slip {slip:.1f} mm · {moment_words(run.created).removesuffix(' UTC')}"
    unknown = list_unknowns(run.summary["unknowns"])
    return RowWords(run.display_name, outcome, tone_name, details, unknown)


def _outcome_words(summary: dict[str, Any]) -> tuple[str, str]:
    outcome = str(summary["outcome"])
    if outcome != Outcome.COMPLETED:
        return outcome.replace("_", " "), "bad"
    held = summary["metrics"]["held"]
    if held is None:
        return "too short to tell", "warning"
    return ("held", "good") if held else ("not held", "warning")


def rows_html(run_list: RunList, open_id: str) -> str:
    """The page of the list.

    Args:
        run_list: The stored runs.
        open_id: The run on the screen, empty if it is not in the list.
    """
    notice = run_list.notice
    box = box_html(escape(notice.title), [escape(_sentence(notice.message))]) if notice else ""
    names = distinct_names(run_list.runs)
    rows = "".join(
        _row_html(run, names[run.id], run.id == run_list.chosen_id, run.id == open_id)
        for run in run_list.runs
    )
    return (
        f"<div class='sg-run-list'>{box}<div class='sg-rows'>{rows or _empty_html(run_list)}</div>"
        f"{_pager_html(run_list)}</div>"
    )


def _row_html(run: StoredRun, name: str, is_chosen: bool, is_open: bool) -> str:
    words = row_words(run)
    kinds = ["sg-row", *["sg-chosen"] * is_chosen, *["sg-open"] * is_open]
    badge = "<span class='sg-small'>on screen</span>" if is_open else ""
    tags = "".join(f" <span class='sg-tag'>{escape(tag)}</span>" for tag in run.tags)
    choosing = clickable(f"Choose {name} ({run.id})", ChooseRecording(run.id))
    opening = clickable(f"Open {run.id} for replay", OpenRecording(run.id))
    return (
        f"<div class='{' '.join(kinds)}'>"
        f"<div {choosing} aria-pressed='{str(is_chosen).lower()}'>"
        f"<div class='sg-row-head'><b title='{escape(name)}'>{escape(name)}</b>{badge}"
        f"<b style='color:{tone(words.tone)}'>{escape(words.outcome)}</b></div>"
        f"<div class='sg-small sg-clipped'>{escape(words.details)}{tags}</div>"
        f"<div class='sg-small sg-clipped'>{escape(words.unknown)}</div></div>"
        f"<div {opening} aria-label='Open {escape(run.id)}'>▶</div></div>"
    )


def _empty_html(run_list: RunList) -> str:
    words = (
        "No stored runs yet: every run is saved once you stop moving the controls."
        if run_list.wanted.is_open
        else "No stored run matches."
    )
    return f"<div class='sg-empty'>{words}</div>"


def _pager_html(run_list: RunList) -> str:
    """The range of the page, and links to newer and older runs."""
    if not run_list.runs:
        return ""
    first = run_list.page * ROWS_PER_PAGE + 1
    last = first + len(run_list.runs) - 1
    what = "stored runs" if run_list.wanted.is_open else "matching runs"
    newer = _page_html("‹ newer", run_list.page - 1, run_list.page > 0)
    older = _page_html("older ›", run_list.page + 1, last < run_list.count)
    words = f"<span>{first} to {last} of {run_list.count} {what}</span>"
    return f"<div class='sg-pager sg-small'>{newer}{words}{older}</div>"


def _page_html(words: str, page: int, is_there: bool) -> str:
    if not is_there:
        return f"<span aria-disabled='true'>{words}</span>"
    return f"<span {clickable('Turn the page', ListRecordings(page))}>{words}</span>"


def chosen_html(run: StoredRun) -> str:
    """Details of the selected run, and links to its files."""
    address = f"{from_page(API_PATH)}/runs/{escape(run.id)}"
    links = ", ".join(f"<a href='{address}/{file}' download>{word}</a>" for file, word in _LINKS)
    notes = f"<div class='sg-notes'>{escape(run.notes)}</div>" if run.notes else ""
    return (
        f"<div class='sg-facts'><b>{escape(run.display_name)}</b>"
        f"<div class='sg-small'>{escape(run.id)} · saved {escape(moment_words(run.created))} · "
        f"{run.size / 1e6:.1f} MB</div><div>Download: {links}</div>{notes}</div>"
    )


def upload_html() -> str:
    """A button that uploads a recording, and a line for the result.

    The page's script sends the file to the REST interface, which validates it completely before
    storing it; the line shows the response.
    """
    hint = (
        "Uploads a recording (MCAP) of slipgrasp; the server reads it completely before storing it."
    )
    return (
        "<div class='sg-run-list'><span class='sg-upload' "
        f"data-sg-upload='{from_page(UPLOAD_PATH)}' title='{hint}' "
        "tabindex='0' role='button'>⇪ Upload a recording"
        "<input type='file' accept='.mcap' hidden></span>"
        "<div class='sg-upload-answer' role='status'></div></div>"
    )


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:].rstrip(".") + "."


def ask_to_confirm(
    gui: viser.GuiApi,
    question: str,
    sentences: Sequence[str],
    answer: str,
    do: Callable[[], None],
) -> None:
    """Asks for a confirmation in a modal window.

    Args:
        gui: The page.
        question: Its title.
        sentences: The explanation, the most important sentence first.
        answer: The label of the button that confirms.
        do: Called if the user confirms.
    """
    modal = gui.add_modal(question)
    first, *rest = map(escape, sentences)
    lines = "".join(f"<div style='opacity:0.75;font-size:0.9em'>{line}</div>" for line in rest)

    async def confirm(_: object) -> None:
        if not modal.closed:
            modal.close()
            do()

    async def leave(_: object) -> None:
        if not modal.closed:
            modal.close()

    with modal:
        gui.add_html(f"<div style='padding:0 0.75em 0.75em'><b>{first}</b>{lines}</div>")
        gui.add_button(answer, color="red", hint="Confirms; this cannot be undone.").on_click(
            confirm
        )
        keep = gui.add_button("Cancel", color="gray", hint="Closes this window without a change.")
        keep.on_click(leave)
