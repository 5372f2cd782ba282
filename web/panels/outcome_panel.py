"""The outcome card: how the run went, in words and in a few numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from html import escape

import viser

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.verdict import Verdict, describe_run
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.core.words.phrases import milliseconds
from slipgrasp.recordings.palette import FINGERS, GHOST, PHASES
from slipgrasp.web.model.colours import css, sign, tone, word
from slipgrasp.web.model.parameter_names import in_page_words
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.view import RunStage, RunStatus, Shown, ViewState

_BUSY = (RunStage.COMPILING, RunStage.SIMULATING, RunStage.OPENING)
_SMALL = "sg-small"
_TOLD = 2


class OutcomePanel:
    """Shows the outcome card, and a bar while something is computed.

    Args:
        gui: Where it goes.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        self._welcome = gui.add_html(welcome_html())
        self._card = gui.add_html("")
        self._busy = gui.add_progress_bar(100.0, animated=True, visible=False)
        self._shown: tuple[RunStatus, int] | None = None

    def update(self, view: ViewState) -> None:
        """Shows how the latest run went, and what became of the latest request."""
        ticket = view.shown.ticket if view.shown else 0
        if self._shown == (view.status, ticket):
            return
        self._shown = (view.status, ticket)
        self._busy.visible = view.status.stage in _BUSY
        self._card.content = outcome_html(view.status, view.shown)

    def remove(self) -> None:
        """Takes everything off the page."""
        self._welcome.remove()
        self._card.remove()
        self._busy.remove()


def welcome_html() -> str:
    """What one sees, for who is here for the first time; the page's script knows who is not."""
    sticks, forward, backward = (
        f"<b style='color:{word(PHASES[phase])}'>{name}</b>"
        for phase, name in (
            (ContactPhase.STICK, "blue"),
            (ContactPhase.SLIP_FORWARD, "orange"),
            (ContactPhase.SLIP_BACKWARD, "pink"),
        )
    )
    return (
        "<div class='sg-welcome'>A hand holds an object by friction alone. The lenses magnify "
        f"its contacts: {sticks} sticks, {forward} and {backward} slip. "
        "<b>Move a knob on the right</b>, and the run is computed anew at once. "
        "<button type='button' data-sg-welcomed title='Does not show this again'>Got it</button>"
        "</div>"
    )


def outcome_html(status: RunStatus, shown: Shown | None) -> str:
    """The whole card as HTML; everything that could come from outside is escaped."""
    verdict = ""
    if shown is not None:
        verdict = _card_html(shown.result)
        if status.stage is RunStage.REFUSED:
            verdict = f"<div style='opacity:0.55'>{verdict}</div>"
    note = status_html(status, shown)
    is_first = status.stage in (RunStage.REFUSED, RunStage.REPLAY)
    parts = [note, verdict] if is_first else [verdict, note]
    return f"<div class='sg-outcome'>{''.join(parts)}</div>"


def _card_html(result: RunResult) -> str:
    """What matters most in plain sight; the rest unfolds, and then stays so."""
    verdict = _verdict_in_page_words(result)
    rest = _paragraph(escape(" ".join(verdict.sentences[_TOLD:])))
    return (
        f"{_verdict_html(verdict)}{_warnings_html(result)}"
        "<details data-sg-fold='outcome'><summary>Squeeze, forces, margins, tracking</summary>"
        f"{rest}{_metrics_html(result)}</details>"
    )


def _verdict_in_page_words(result: RunResult) -> Verdict:
    """How the run went, with parameters called as on their knobs."""
    verdict, scenario = describe_run(result), result.scenario
    told = tuple(in_page_words(text, scenario) for text in verdict.sentences)
    suggestion = in_page_words(verdict.suggestion, scenario)
    return replace(verdict, sentences=told, suggestion=suggestion)


def status_html(status: RunStatus, shown: Shown | None) -> str:
    """What became of the latest request, as HTML."""
    if status.stage is RunStage.COMPILING:
        return _paragraph(
            f"<b>Preparing the simulation: {' '.join(status.messages)}.</b> "
            "It is compiled for this machine, once; later starts find it ready."
        )
    if status.stage is RunStage.OPENING:
        return _paragraph("Opening the recording …", _SMALL)
    if status.stage is RunStage.UNREADABLE:
        return box_html(
            "Not opened", [*map(escape, status.messages), "Choose a scenario or a run."]
        )
    if status.stage is RunStage.REPLAY and shown and shown.replay:
        return _replay_html(shown.replay)
    if status.stage is RunStage.SIMULATING:
        return _paragraph("Simulating …", _SMALL)
    if status.stage is RunStage.REFUSED:
        kept = " The picture still shows the last run that worked." if shown else ""
        return box_html("Not simulated", [*map(escape, status.messages), kept])
    if status.stage is RunStage.NOT_SAVED:
        return box_html("Not saved", map(escape, status.messages))
    speed = f"Computed in {milliseconds(shown.elapsed)}. " if shown else ""
    if status.stage is RunStage.SAVED:
        return _paragraph(f"{speed}Saved as <b>{escape(status.run_id)}</b>.", _SMALL)
    return _paragraph(f"{speed}A preview; it is saved once the knobs rest.", _SMALL)


def _replay_html(replay: Replay) -> str:
    """That nothing was computed, and where the numbers come from."""
    how = " It is not finished: this is what it holds so far." if replay.is_unfinished else ""
    program = f"Computed by slipgrasp {escape(replay.result.provenance.program)}."
    return (
        f"<div class='sg-box sg-replay' style='--sg-tone:{css(GHOST)}'>"
        f"<b>Replay of {escape(replay.name)}</b>"
        f"{_paragraph(f'Recorded {escape(replay.recorded)}. {program}{how}', _SMALL)}</div>"
    )


def _verdict_html(verdict: Verdict) -> str:
    head = (
        f"<div class='sg-verdict' style='color:{tone(verdict.tone)}'>{escape(verdict.headline)}"
        "</div>"
    )
    body = _paragraph(escape(" ".join(verdict.sentences[:_TOLD])))
    if not verdict.suggestion:
        return head + body
    return head + body + _paragraph(f"<b>Try:</b> {escape(verdict.suggestion)}")


def _warnings_html(result: RunResult) -> str:
    """What did not end the run but is worth knowing, each with how often and when first."""
    return "".join(
        _paragraph(
            f"Note: {escape(warning.message)} ({_times(warning.count)}, first at "
            f"t = {milliseconds(warning.first_time)}).",
            _SMALL,
        )
        for warning in result.warnings
    )


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _metrics_html(result: RunResult) -> str:
    """One row per finger, and how far the object was from where it should be."""
    head = "".join(
        f"<th title='{hint}'>{title}</th>"
        for title, hint in (
            ("slip path", "Way the fingertip slid on its face"),
            ("peak Fₙ", "Largest normal force"),
            ("least margin", "Least tangential force that was missing for slip, while it stuck"),
        )
    )
    rows = "".join(f"<tr>{row}</tr>" for row in _finger_rows(result))
    final, ways = result.metrics.final_tracking_error, 3 if result.scenario.in_space else 2
    rms = math.hypot(*result.metrics.rms_tracking_error[:ways])
    tracking = (
        f"Object off its desired pose: {1e3 * math.hypot(*final[:ways]):.1f} mm and "
        f"{math.degrees(math.hypot(*final[ways:])):.1f}° at the end, {1e3 * rms:.1f} mm rms."
    )
    return f"<table><tr><th></th>{head}</tr>{rows}</table>{_paragraph(tracking, _SMALL)}"


def _finger_rows(result: RunResult) -> Iterator[str]:
    metrics = result.metrics
    for i, name in enumerate(result.scenario.finger_names):
        margin = metrics.minimum_friction_margin[i]
        values = (
            f"{1e3 * metrics.slip_path[i]:.2f} mm",
            f"{metrics.peak_normal_force[i]:.1f} N",
            "–" if margin is None else f"{round(margin, 2) + 0.0:.2f} N",
        )
        cells = "".join(f"<td>{value}</td>" for value in values)
        swatch = f"<span style='color:{sign(FINGERS[i % len(FINGERS)])}'>●</span>"
        yield f"<td>{swatch} {escape(name)}</td>{cells}"


def _paragraph(text: str, kind: str = "") -> str:
    return f"<p class='{kind}'>{text}</p>" if text else ""


def box_html(title: str, sentences: Iterator[str] | list[str]) -> str:
    """Something that went wrong: a title, and sentences that are HTML already."""
    body = "".join(map(_paragraph, sentences))
    return f"<div class='sg-box' style='--sg-tone:{tone('bad')}'><b>{title}</b>{body}</div>"
