"""The outcome card: the outcome in words, and some numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from html import escape

import numpy as np
import viser

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.trying import TriedHint, TriedOption
from slipgrasp.core.run.verdict import Verdict, describe_run
from slipgrasp.core.scenario import PLANAR, RAIL, Scenario, Space
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.core.words.hints import Goal
from slipgrasp.core.words.knowledge_words import describe_knowledge
from slipgrasp.core.words.phrases import joined, length_words, milliseconds, sentence
from slipgrasp.recordings.palette import FINGERS, GHOST, PHASES
from slipgrasp.web.model.colours import css, sign, tone, word
from slipgrasp.web.model.intents.heavier import AskHowHeavy
from slipgrasp.web.model.intents.playback import Seek
from slipgrasp.web.model.intents.premises import FindPremises
from slipgrasp.web.model.intents.scenario import TryOut
from slipgrasp.web.model.parameter_names import in_page_words
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.view import RunStage, RunStatus, Shown, ShownPremises, ViewState
from slipgrasp.web.page.markup import click_attribute, clickable

_BUSY = (RunStage.COMPILING, RunStage.SIMULATING, RunStage.OPENING)
_SMALL = "sg-small"
_TOLD = 2
_TRIED_SOON = (RunStage.PREVIEW, RunStage.SAVING, RunStage.SAVED)
_TONES = (
    "Green: held near its target after little slip (up to a tenth of the size of the object is "
    "little); amber: any other completed run; red: ended early."
)


class OutcomePanel:
    """Shows the outcome card, and a progress bar during computations.

    Args:
        gui: Parent of the widgets.
    """

    def __init__(self, gui: viser.GuiApi) -> None:
        self._welcome, self._space = gui.add_html(welcome_html()), PLANAR
        self._card = gui.add_html("")
        self._busy = gui.add_progress_bar(100.0, animated=True, visible=False)
        self._shown: tuple[RunStatus, int, str, ShownPremises | None, TriedHint | None] | None = (
            None
        )

    def update(self, view: ViewState) -> None:
        """Shows the outcome of the latest run, and the status of the latest request."""
        ticket = view.shown.ticket if view.shown else 0
        how_heavy = view.how_heavy.words if view.how_heavy.draft is view.draft else ""
        tried = view.hint_trials.of(view.draft)
        shown = (view.status, ticket, how_heavy, view.premises, tried)
        if shown == self._shown:
            return
        self._shown = shown
        self._busy.visible = view.status.stage in _BUSY
        card = outcome_html(view.status, view.shown, how_heavy, premises_html(view), tried)
        self._card.content = card
        space = PLANAR if view.shown is None else view.shown.result.scenario.space
        if space is not self._space:
            self._space = space
            self._welcome.content = welcome_html(space)


def welcome_html(space: Space = PLANAR) -> str:
    """A short introduction for new users; the page's script hides it for others.

    Args:
        space: Kind of scenario.
    """
    sticks, forward, backward = (
        f"<b style='color:{word(PHASES[phase])}'>{name}</b>"
        for phase, name in (
            (ContactPhase.STICK, "blue"),
            (ContactPhase.SLIP_FORWARD, "orange"),
            (ContactPhase.SLIP_BACKWARD, "pink"),
        )
    )
    about = (
        "A hand holds an object by friction alone. The close-ups show its contacts: "
        f"{sticks} sticks, {forward} and {backward} slip."
        if space.has_hand
        else f"A body slides on a support: {sticks} sticks, {forward} slips."
    )
    what = "<b>Drag the object</b> with the mouse or move a slider"
    if space is RAIL:
        about = (
            "A finger pushes or drags an object along a rail. The colours of fingertip and rail: "
            f"{sticks} sticks, {forward} and {backward} slip."
        )
        what = "<b>Move a slider</b>"
    return (
        f"<div class='sg-welcome'>{about} {what}: "
        "the run is simulated again at once. "
        "<button type='button' data-sg-welcomed title='Hides this text permanently'>Got it</button>"
        "</div>"
    )


def outcome_html(
    status: RunStatus,
    shown: Shown | None,
    how_heavy: str = "",
    premises: str = "",
    tried: TriedHint | None = None,
) -> str:
    """The whole card as HTML; all external text is escaped.

    Args:
        status: The status of the latest request.
        shown: The run on the screen.
        how_heavy: Text about the largest mass; empty unless requested.
        premises: The assumptions of the theorems, as HTML.
        tried: The tried hint; None while it is being tried.
    """
    card = ""
    if shown is not None:
        outcome, scenario = describe_run(shown.result), shown.result.scenario
        hint = _hint_html(outcome, tried, scenario, will_try=status.stage in _TRIED_SOON)
        card = _card_html(shown.result, outcome, how_heavy, premises, hint)
        if status.stage is RunStage.REFUSED:
            card = f"<div style='opacity:0.55'>{card}</div>"
    note = status_html(status, shown)
    is_first = status.stage in (RunStage.REFUSED, RunStage.REPLAY)
    parts = [note, card] if is_first else [card, note]
    return f"<div class='sg-outcome'>{''.join(parts)}</div>"


def _card_html(
    result: RunResult, outcome: Verdict, how_heavy: str, premises: str, hint: str
) -> str:
    """The main facts; the details can be expanded."""
    known = describe_knowledge(result.scenario)
    sentences = [text for text in outcome.sentences if text != known]
    told = [in_page_words(text, result.scenario) for text in sentences]
    scenario = result.scenario
    first = _TOLD + bool(scenario.pulses) + bool(scenario.changes)
    tones = _TONES if scenario.space.has_hand else ""
    return (
        f"<div class='sg-verdict' style='color:{tone(outcome.tone)}' title='{tones}'>"
        f"{escape(outcome.headline)}</div>{_paragraph(escape(' '.join(told[:first])))}"
        f"{_asked_html(result, how_heavy)}{hint}{_warnings_html(result)}"
        f"<details data-sg-fold='outcome'><summary>{_details_of(result)}</summary>"
        f"{_knowledge_html(known, result)}"
        f"{_paragraph(escape(' '.join(told[first:])))}{_metrics_html(result)}{premises}</details>"
    )


def _details_of(result: RunResult) -> str:
    """The title of the details, which lists their content."""
    if result.scenario.space.has_hand:
        return "Knowledge, forces, margins, tracking"
    has_control = result.scenario.space.has_control
    return "Forces, margins, tracking" if has_control else "Friction and margins"


def _knowledge_html(known: str, result: RunResult) -> str:
    """The parameters that the controller knew; bold if it knew all; empty without a hand."""
    if not known:
        return ""
    return _paragraph(f"<b>{escape(known)}</b>" if result.knowledge.told else escape(known), _SMALL)


def _asked_html(result: RunResult, how_heavy: str) -> str:
    """Buttons for the first slip and for the largest mass, and the largest mass if it is known."""
    buttons = _first_slip_html(result) + ("" if how_heavy else _how_heavy_html(result))
    answer = f"<p role='status'>How much heavier? {escape(how_heavy)}</p>" if how_heavy else ""
    return (f"<div class='sg-tries'>{buttons}</div>" if buttons else "") + answer


def _first_slip_html(result: RunResult) -> str:
    """A button with the first fingertip to slip, which leads to that time; empty if none slips."""
    trace = result.trace
    slips = trace.phase != ContactPhase.STICK
    if not slips.any() or not result.scenario.space.has_hand:
        return ""
    time = float(trace.times[int(np.argmax(slips.any(axis=1)))])
    first = slips[trace.times == time].any(axis=0)
    names = [name for name, slid in zip(result.scenario.finger_names, first, strict=True) if slid]
    return (
        "<button type='button' class='sg-try' title='Moves the play head to this time' "
        f"{click_attribute(Seek(time))}>First to slip: {escape(joined(names))}, "
        f"t = {1e3 * time:.4g} ms</button>"
    )


def _hint_html(
    outcome: Verdict, tried: TriedHint | None, scenario: Scenario, *, will_try: bool
) -> str:
    """Hints: a button with its effect for each option that helped when it was tried.

    If no trial is possible, or none helped, the hint is a sentence.
    """
    if outcome.hint.goal is Goal.MARGIN:
        varied = "friction of all fingers" if any(f.friction for f in scenario.fingers) else "mass"
        button = "<button type='button' class='sg-try' title='Shows the tab Study'"
        words = f"data-sg-tab='Study'>Vary the {varied}</button>"
        return _paragraph(f"<b>How large is the margin?</b> {button} {words}")
    if tried is None and will_try:
        return _paragraph("<b>Try:</b> simulating what could help …") * bool(outcome.suggestion)
    if tried is None or not tried.helpful:
        words = sentence(str(tried)) if tried is not None else outcome.suggestion
        told = escape(in_page_words(words, scenario))
        title = "Tried" if tried is not None and tried.count else "Try"
        return _paragraph(f"<b>{title}:</b> {told}") if told else ""
    rows = "".join(_tried_html(each, scenario) for each in tried.helpful)
    # The effects beside the buttons show the distance from the target, and the slip.
    is_told = tried.hint.purpose and tried.hint.goal is not Goal.NEARER
    purpose = f" {tried.hint.purpose}" if is_told else ""
    rest = in_page_words(str(tried.hint.rest), scenario)
    return (
        _paragraph(f"<b>Try{purpose}:</b>")
        + f"<div class='sg-tried' role='group' aria-label='What to try'>{rows}</div>"
        + (_paragraph(escape(f"Or {rest}.")) if rest else "")
    )


def _tried_html(tried: TriedOption, scenario: Scenario) -> str:
    label = in_page_words(tried.option.label, scenario)
    return (
        "<button type='button' class='sg-try' title='Sets this for the whole run; it can be "
        f"undone' {click_attribute(TryOut(label))}>{escape(label)}</button>"
        f"<span>{escape(tried.effect)}</span>"
    )


def _how_heavy_html(result: RunResult) -> str:
    """The button that searches for the largest mass of a held object."""
    is_poured = any(change.parameter == "object.mass" for change in result.scenario.changes)
    if not result.metrics.held or is_poured or not result.scenario.space.has_hand:
        return ""
    hint = "Simulates the scenario with heavier and heavier objects of the same inertia"
    return (
        f"<button type='button' class='sg-try' title='{hint}' "
        f"{click_attribute(AskHowHeavy())}>How much heavier may it get?</button>"
    )


def premises_html(view: ViewState) -> str:
    """The assumptions of the theorems for the run on the screen, or a link that requests them."""
    if view.offers_premises:
        hint = "Compares the assumptions and bounds of the paper's theorems with this run."
        asks = clickable(hint, FindPremises())
        return f"<p class='{_SMALL}'><u {asks}>Assumptions of the theorems</u></p>"
    told, ticket = view.premises, view.shown.ticket if view.shown else 0
    if told is None or told.ticket != ticket:
        return ""
    return "".join(_paragraph(escape(text), _SMALL) for text in told.sentences or ("Looking …",))


def status_html(status: RunStatus, shown: Shown | None) -> str:
    """The status of the latest request, as HTML."""
    if status.stage is RunStage.COMPILING:
        return _paragraph(
            f"<b>Compiling the simulation for this machine: {' '.join(status.messages)}.</b> "
            "This happens once; later starts load the result."
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
        kept = " The view still shows the last valid run." if shown else ""
        return box_html("Not simulated", [*map(escape, status.messages), kept])
    if status.stage is RunStage.NOT_SAVED:
        return box_html("Not saved", map(escape, status.messages))
    speed = f"Computed in {milliseconds(shown.elapsed)}. " if shown else ""
    if status.stage is RunStage.SAVED:
        return _paragraph(f"{speed}Saved as <b>{escape(status.run_id)}</b>.", _SMALL)
    return _paragraph(f"{speed}A preview; it is saved once you stop moving the controls.", _SMALL)


def _replay_html(replay: Replay) -> str:
    """A note that the run is a replay, and its origin."""
    how = " The recording is not finished yet." if replay.is_unfinished else ""
    program = f"Computed by slipgrasp {escape(replay.result.provenance.program)}."
    return (
        f"<div class='sg-box sg-replay' style='--sg-tone:{css(GHOST)}'>"
        f"<b>Replay of {escape(replay.name)}</b>"
        f"{_paragraph(f'Recorded {escape(replay.recorded)}. {program}{how}', _SMALL)}</div>"
    )


def _warnings_html(result: RunResult) -> str:
    """Warnings of the run, with their number and their first time."""
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
    """A table with one row per finger, and the tracking error of the object."""
    has_hand = result.scenario.space.has_hand
    who = "the fingertip slid on its face" if has_hand else "the contact slid"
    head = "".join(
        f"<th title='{hint}'>{title}</th>"
        for title, hint in (
            ("slip path", f"Distance that {who}"),
            ("peak Fₙ", "Largest normal force"),
            ("smallest margin in stick", "Smallest margin between tangential force and slip limit"),
        )
    )
    rows = "".join(f"<tr>{row}</tr>" for row in _finger_rows(result))
    table = f"<table><tr><th></th>{head}</tr>{rows}</table>"
    if not has_hand:
        return table
    if result.scenario.space is RAIL:
        return table
    final, ways = result.metrics.final_tracking_error, result.scenario.space.num_positions
    rms = math.hypot(*result.metrics.rms_tracking_error[:ways])
    tracking = (
        f"Object off its desired pose: {length_words(math.hypot(*final[:ways]))} and "
        f"{math.degrees(math.hypot(*final[ways:])):.1f}° at the end, {length_words(rms)} rms."
    )
    return f"{table}{_paragraph(tracking, _SMALL)}"


def _finger_rows(result: RunResult) -> Iterator[str]:
    metrics = result.metrics
    for i, name in enumerate(result.scenario.finger_names):
        margin = metrics.minimum_friction_margin[i]
        values = (
            length_words(metrics.slip_path[i]),
            f"{metrics.peak_normal_force[i]:.1f} N",
            "–" if margin is None else f"{round(margin, 2) + 0.0:.2f} N",
        )
        cells = "".join(f"<td>{value}</td>" for value in values)
        swatch = f"<span style='color:{sign(FINGERS[i % len(FINGERS)])}'>●</span>"
        yield f"<td>{swatch} {escape(name)}</td>{cells}"


def _paragraph(text: str, kind: str = "") -> str:
    return f"<p class='{kind}'>{text}</p>" if text else ""


def box_html(title: str, sentences: Iterator[str] | list[str]) -> str:
    """A box with an error: a title, and sentences in HTML."""
    body = "".join(map(_paragraph, sentences))
    return f"<div class='sg-box' style='--sg-tone:{tone('bad')}'><b>{title}</b>{body}</div>"
