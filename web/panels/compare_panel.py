"""Two runs over each other: which they are, and what tells them apart."""

from __future__ import annotations

from html import escape

import viser

from slipgrasp.core.run.verdict import headline_of
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.web.model.intents.compare import CompareRuns
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.pairing import can_swap, pair_of
from slipgrasp.web.model.replay import moment_words
from slipgrasp.web.model.view import Shown, ViewState
from slipgrasp.web.page.markup import click_attribute
from slipgrasp.web.panels.compare_html import findings_html, first_divergence
from slipgrasp.web.panels.outcome_panel import box_html
from slipgrasp.web.panels.recordings_html import row_words

ON_SCREEN: str = "the run on the screen"
NONE: str = "none"

_LONGEST_NAME = 80
_INVITATION = (
    "<p><b>See two runs over each other.</b> Choose a stored run B: it is drawn pale below the "
    "run on the screen, in the scene, on the strip and in the charts, and a table tells what "
    "differs. After a knob was moved, the run before the change is compared in the same way.</p>"
)


class ComparePanel:
    """Chooses two runs and shows what tells them apart.

    Args:
        gui: Where it goes.
        send: Takes the intents.

    Attributes:
        a: Chooses the run on the screen.
        b: Chooses the pale run.
        findings: What tells them apart.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        self._ids: dict[str, str] = {}
        self._drawn: tuple[object, ...] = ()
        self.a = gui.add_dropdown(
            "A, on screen", (ON_SCREEN,), hint="The run that is drawn in full colours."
        )
        self.b = gui.add_dropdown(
            "B, pale", (NONE,), hint="The stored run that is drawn pale below it."
        )
        self.findings = gui.add_html("")
        for picker in (self.a, self.b):
            picker.on_update(self._choose)

    def update(self, view: ViewState) -> None:
        """Shows the two runs, and what tells them apart as far as that is known."""
        drawn = (view.shown, view.ghost, view.comparing, view.run_list.recent, view.status.run_id)
        if drawn == self._drawn:
            return
        self._drawn = drawn
        self._show_choices(view)
        self.findings.content = compare_html(view)

    def remove(self) -> None:
        """Takes everything off the page."""
        for element in (self.a, self.b, self.findings):
            element.remove()

    def _show_choices(self, view: ViewState) -> None:
        on_screen = view.shown.replay if view.shown else None
        pale = view.ghost.shown.replay if view.ghost else None
        labels = {run.id: _choice_label(run) for run in view.run_list.recent}
        for replay in (on_screen, pale):
            if replay is not None and replay.run_id:
                labels.setdefault(replay.run_id, f"{_shortened(replay.name)} · {replay.run_id}")
        self._ids = {label: run_id for run_id, label in labels.items()}
        for picker, empty, replay in ((self.a, ON_SCREEN, on_screen), (self.b, NONE, pale)):
            options = (empty, *self._ids)
            if options != picker.options:
                picker.options = options
            picker.value = labels.get(replay.run_id, empty) if replay else empty

    async def _choose(self, event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
        # Values that the program sets come without a client; they must not come back.
        if event.client_id is not None:
            a, b = (self._ids.get(picker.value, "") for picker in (self.a, self.b))
            self._send(CompareRuns(a, b))


def compare_html(view: ViewState) -> str:
    """The two runs, and what tells them apart."""
    message = view.comparing.message
    box = box_html("Not compared", [escape(f"{message}.")]) if message else ""
    if view.shown is None or view.ghost is None:
        return f"<div class='sg-compare'>{box}{_INVITATION}</div>"
    live = "" if view.shown.replay else ", live"
    heads = _run_html("A", view.shown.name + live, view.shown)
    heads += _run_html("B", view.ghost.label, view.ghost.shown)
    body = _body_html(view, view.shown)
    return f"<div class='sg-compare'>{heads}{_actions_html(view)}{box}{body}</div>"


def _run_html(letter: str, name: str, shown: Shown) -> str:
    """Which run a letter stands for, and how it went; the pale one is pale."""
    headline = headline_of(shown.result)
    return (
        f"<div class='sg-run {'' if letter == 'A' else 'sg-pale'}'><span>{letter}</span>"
        f"<div><b>{escape(name)}</b><br>{escape(headline)}</div></div>"
    )


def _actions_html(view: ViewState) -> str:
    findings = view.comparing.findings
    first = None if findings is None else first_divergence(findings)
    return (
        "<div class='sg-actions'>"
        + _button("⇥ First difference", first is not None, "seek", time=first or 0.0)
        + _button("⇄ Swap", can_swap(view), "swap-runs")
        + _button("✕ End", True, "end-comparison")
        + "</div>"
    )


_HINTS = {
    "seek": "Puts the play head where the first signal of the two runs differs.",
    "swap-runs": "Puts the pale run on the screen and the other below it; both must be saved.",
    "end-comparison": "Shows the run on the screen alone.",
}


def _button(words: str, is_offered: bool, kind: str, **fields: float) -> str:
    off = "" if is_offered else "disabled"
    return (
        f"<button {click_attribute(kind, **fields)} title='{_HINTS[kind]}' {off}>{words}</button>"
    )


def _body_html(view: ViewState, shown: Shown) -> str:
    """What tells the runs apart; what is known of another pair stays, dimmed, until then."""
    findings, is_current = view.comparing.findings, view.comparing.pair == pair_of(view)
    if findings is None:
        return "" if is_current else "<p>Comparing …</p>"
    names = shown.result.scenario.finger_names
    if len(names) != len(findings.metrics.get("slip_path", (names,))[0]):
        return "<p>Comparing …</p>"
    body = findings_html(findings, names, _common_unknowns(view))
    return body if is_current else f"<div class='sg-outdated'>{body}</div>"


def _common_unknowns(view: ViewState) -> tuple[str, ...]:
    """What both runs on the screen estimate; empty if that is not the same."""
    runs = [shown for shown in (view.shown, view.ghost and view.ghost.shown) if shown]
    lists = {tuple(e.parameter for e in each.result.scenario.estimates) for each in runs}
    return lists.pop() if len(lists) == 1 else ()


def _choice_label(run: StoredRun) -> str:
    words = row_words(run)
    moment = moment_words(run.created).removesuffix(" UTC")
    return f"{_shortened(words.label)} · {words.outcome} · {moment} · {run.id}"


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST_NAME else f"{text[: _LONGEST_NAME - 1].rstrip()}…"
