"""The stored runs: a page of them, and what can be done with the one that is chosen."""

from __future__ import annotations

from typing import Any

import viser

from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.web.model.intents.compare import CompareRuns
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.recordings import (
    AnnotateRecording,
    DeleteRecording,
    FilterRecordings,
    OpenRecording,
)
from slipgrasp.web.model.run_list import OUTCOME_CHOICES, RunList
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.panels.confirmation import ask_to_confirm
from slipgrasp.web.panels.recordings_html import chosen_html, row_words, rows_html, upload_html


class RecordingsPanel:
    """Lists the stored runs, newest first, and changes the one that is chosen.

    Args:
        gui: Where it goes.
        send: Takes the intents.

    Attributes:
        rows: The page of the list.
        chosen: What can be done with the run that is chosen.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._gui, self._send = gui, send
        self._text = gui.add_text(
            "find", "", hint="Lists runs that have this in their title, name or notes."
        )
        self._outcome = gui.add_dropdown(
            "outcome", OUTCOME_CHOICES, hint="Lists runs that went this way only."
        )
        for widget in (self._text, self._outcome):
            widget.on_update(self._filter)
        self.rows = gui.add_html("")
        self.chosen = _ChosenRun(gui, send)
        self._upload = gui.add_html(upload_html())
        self._run_list: RunList | None = None
        self._open_id = ""

    def update(self, view: ViewState) -> None:
        """Shows a page of the list, which run is chosen, and which is on the screen."""
        replay = view.shown.replay if view.shown else None
        open_id = replay.run_id if replay else view.status.run_id
        if (view.run_list, open_id) == (self._run_list, self._open_id):
            return
        self._run_list, self._open_id = view.run_list, open_id
        self.rows.content = rows_html(view.run_list, open_id)
        self.chosen.show(view.run_list.chosen)

    def remove(self) -> None:
        """Takes everything off the page."""
        for element in (self._text, self._outcome, self.rows, self.chosen, self._upload):
            element.remove()

    async def _filter(self, event: viser.GuiEvent[Any]) -> None:
        # Runs in the viewer server's event loop, which keeps the order of what is typed.
        if event.client_id is not None:
            self._send(FilterRecordings(self._text.value, self._outcome.value))


class _ChosenRun:
    """Opens, compares, renames, tags and deletes one stored run; hidden without one.

    Args:
        gui: Where it goes.
        send: Takes the intents.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._gui, self._send = gui, send
        self._run: StoredRun | None = None
        self.folder = gui.add_folder("Chosen run", visible=False)
        with self.folder:
            self.words = gui.add_html("")
            self.open = gui.add_button(
                "Open for replay",
                icon=viser.Icon.PLAYER_PLAY,
                hint="Shows this run on the screen, bit for bit as it was recorded.",
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
                hint="Deletes this run and what is written about it for good; asks before.",
            )
        self.open.on_click(self._open)
        self.compare.on_click(self._compare)
        self.delete.on_click(self._ask)

    def _add_form(self) -> None:
        with self._gui.add_form("Name and tags", expand_by_default=False) as self.form:
            self.name = self._gui.add_text(
                "name", "", hint="What to call the run; at most 200 characters. Enter saves it."
            )
            self.tags = self._gui.add_text(
                "tags", "", hint="Words to find it by, with commas between. Enter saves them."
            )
            self.notes = self._gui.add_text(
                "notes", "", multiline=True, hint="Whatever else there is to say about the run."
            )
            self.save = self._gui.add_button(
                "Save", color="gray", hint="Keeps name, tags and notes beside the recording."
            )
        self.save.on_click(lambda _: self.form.submit())
        self.form.on_submit(self._annotate)

    def show(self, run: StoredRun | None) -> None:
        """Shows a run; what a user is writing about it stays unless it has changed."""
        before, self._run = self._run, run
        self.folder.visible = run is not None
        if run is None or run == before:
            return
        self.words.content = chosen_html(run)
        if before is None or run.id != before.id or run.annotations != before.annotations:
            self.name.value = run.name
            self.tags.value = ", ".join(run.tags)
            self.notes.value = run.notes

    def remove(self) -> None:
        """Takes everything off the page."""
        self.folder.remove()

    async def _open(self, _: object) -> None:
        if self._run is not None:
            self._send(OpenRecording(self._run.id))

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
                "Delete this run for good?",
                (words.label, f"{run.id} · {words.outcome} · {words.details}"),
                "Delete",
                lambda: self._send(DeleteRecording(run.id, run.revision)),
            )
