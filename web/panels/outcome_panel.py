"""The outcome card: how the run went, in words and in a few numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from html import escape

import viser

from core.result import RunResult
from server.schemas import API_PATH
from web.colours import FINGERS, GHOST, css, tone
from web.library.replay import Replay
from web.scenario.verdict import Verdict, describe_outcome
from web.view import RunStage, RunStatus, Shown, ViewState
from web.words import milliseconds

__all__ = ["OutcomePanel", "box_html", "outcome_html", "status_html"]

_BUSY = (RunStage.COMPILING, RunStage.SIMULATING, RunStage.OPENING)
_WORDS = "font-size:0.9em"
_SMALL = "font-size:0.8em;opacity:0.8"


class OutcomePanel:
    """Shows the outcome card, and a bar while something is computed.

    Args:
        gui: Where it goes.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
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
        self._card.remove()
        self._busy.remove()


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
    return f"<div style='padding:0.5em 0.75em;line-height:1.4'>{''.join(parts)}</div>"


def _card_html(result: RunResult) -> str:
    return _verdict_html(describe_outcome(result)) + _metrics_html(result) + _warnings_html(result)


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
        return _paragraph(speed + _saved_html(status.run_id), _SMALL)
    return _paragraph(f"{speed}A preview; it is saved once the knobs rest.", _SMALL)


def _saved_html(run_id: str) -> str:
    return f"Saved as <b>{escape(run_id)}</b>: {_links_html(run_id)}"


def _links_html(run_id: str) -> str:
    run = f"{API_PATH}/runs/{escape(run_id)}"
    return (
        f"<a href='{run}/recording' download>MCAP</a>, <a href='{run}/signals.csv' download>CSV</a>"
    )


def _replay_html(replay: Replay) -> str:
    """That nothing was computed, and where the numbers come from."""
    how = " It is not finished: this is what it holds so far." if replay.is_unfinished else ""
    links = f" {_links_html(replay.run_id)}" if replay.run_id else ""
    program = f"Computed by slipgrasp {escape(replay.result.provenance.program)}."
    return (
        f"<div style='border-left:4px solid {css(GHOST)};padding-left:0.6em;margin-bottom:0.6em'>"
        f"<b>Replay of {escape(replay.name)}</b>"
        f"{_paragraph(f'Recorded {escape(replay.recorded)}. {program}{how}{links}', _SMALL)}</div>"
    )


def _verdict_html(verdict: Verdict) -> str:
    colour = tone(verdict.tone)
    head = (
        f"<div style='font-weight:700;font-size:1.15em;color:{colour};"
        f"border-left:4px solid {colour};padding-left:0.5em'>{escape(verdict.headline)}</div>"
    )
    body = _paragraph(escape(" ".join(verdict.sentences)), _WORDS)
    if not verdict.suggestion:
        return head + body
    return head + body + _paragraph(f"<b>Try:</b> {escape(verdict.suggestion)}", _WORDS)


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
        f"<th style='text-align:right;font-weight:500' title='{hint}'>{title}</th>"
        for title, hint in (
            ("slip path", "Way the fingertip slid on its face"),
            ("peak Fₙ", "Largest normal force"),
            ("least margin", "Least tangential force that was missing for slip, while it stuck"),
        )
    )
    rows = "".join(f"<tr>{row}</tr>" for row in _finger_rows(result))
    x, y, tilt = result.metrics.final_tracking_error
    rms = math.hypot(*result.metrics.rms_tracking_error[:2])
    tracking = (
        f"Object off its desired pose: {1e3 * math.hypot(x, y):.1f} mm and "
        f"{abs(math.degrees(tilt)):.1f}° at the end, {1e3 * rms:.1f} mm rms."
    )
    table = f"<table style='width:100%;border-spacing:0'><tr><th></th>{head}</tr>{rows}</table>"
    return f"<div style='{_SMALL};margin-top:0.4em'>{table}{tracking}</div>"


def _finger_rows(result: RunResult) -> Iterator[str]:
    metrics = result.metrics
    for i, name in enumerate(result.scenario.finger_names):
        margin = metrics.minimum_friction_margin[i]
        values = (
            f"{1e3 * metrics.slip_path[i]:.2f} mm",
            f"{metrics.peak_normal_force[i]:.1f} N",
            "–" if margin is None else f"{margin:.2f} N",
        )
        cells = "".join(f"<td style='text-align:right'>{value}</td>" for value in values)
        swatch = f"<span style='color:{css(FINGERS[i % len(FINGERS)])}'>●</span>"
        yield f"<td>{swatch} {escape(name)}</td>{cells}"


def _paragraph(text: str, style: str = "") -> str:
    return f"<p style='margin:0.25em 0 0 0;{style}'>{text}</p>"


def box_html(title: str, sentences: Iterator[str] | list[str]) -> str:
    """Something that went wrong: a title, and sentences that are HTML already."""
    red = tone("bad")
    body = "".join(_paragraph(sentence) for sentence in sentences if sentence)
    return (
        f"<div style='border-left:4px solid {red};padding-left:0.6em;margin-bottom:0.5em'>"
        f"<b style='color:{red}'>{title}</b>{body}</div>"
    )
