"""Two overlaid runs: their names, and their differences."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from html import escape
from typing import Any

import viser

from slipgrasp.core.run.metrics import METRICS
from slipgrasp.core.run.verdict import headline_of
from slipgrasp.core.scenario.field_errors import find_template
from slipgrasp.core.scenario.parameters import ParameterDifference
from slipgrasp.core.scenario.space import PLANAR, Space
from slipgrasp.core.words.parameter_words import estimate_words, key_words, unit_words
from slipgrasp.recordings.compare.comparison import Comparison
from slipgrasp.recordings.compare.differences import PhaseDifference, SignalDifference
from slipgrasp.recordings.compare.measured import Distances, SignalDistance
from slipgrasp.recordings.palette import PHASES
from slipgrasp.recordings.store.stored_run import StoredRun
from slipgrasp.web.model.colours import css
from slipgrasp.web.model.compare_words import (
    METRIC_ACCURACY,
    MISSING,
    Scale,
    amount,
    column_words,
    coordinate_words,
    metric_words,
    scale_of,
    scaled,
    scaled_metric,
    time_words,
    value_words,
)
from slipgrasp.web.model.events import PHASE_HINTS
from slipgrasp.web.model.intents.compare import CompareRuns, EndComparison, SwapRuns
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.intents.playback import Seek
from slipgrasp.web.model.pairing import can_swap, pair_of
from slipgrasp.web.model.replay import moment_words
from slipgrasp.web.model.view import Shown, ViewState
from slipgrasp.web.page.markup import click_attribute, clickable
from slipgrasp.web.panels.outcome_panel import box_html
from slipgrasp.web.panels.recordings_panel import row_words

ON_SCREEN: str = "the run on the screen"
NONE: str = "none"

_LONGEST_NAME = 80
_INVITATION = (
    "<p><b>Compare two runs.</b> Choose a stored run B: it is drawn pale behind the "
    "run on the screen, in the view, on the timeline and in the charts, and a table lists what "
    "differs. When a control is moved, the run before the change becomes the ghost.</p>"
)

_HINTS: dict[type[Intent], str] = {
    Seek: "Puts the play head where signals of the two runs first differ.",
    SwapRuns: "Swaps the run on the screen and the ghost; both must be saved.",
    EndComparison: "Shows the run on the screen alone.",
}
MOST_PHASE_CHANGES = 12
_PER = {metric.name: metric.per for metric in METRICS}
_LONGEST_VALUE = 40
_DIFFERENCE = "B − A"


class ComparePanel:
    """Chooses two runs and shows their differences.

    Args:
        gui: Parent of the widgets.
        send: Accepts the intents.

    Attributes:
        a: Selects the run on the screen.
        b: Selects the ghost.
        findings: Their differences.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        self._ids: dict[str, str] = {}
        self._drawn: tuple[object, ...] = ()
        self.a = gui.add_dropdown(
            "A, on screen", (ON_SCREEN,), hint="The run that is drawn in full colours."
        )
        self.b = gui.add_dropdown(
            "B, ghost", (NONE,), hint="The stored run that is drawn pale behind A."
        )
        self.findings = gui.add_html("")
        for picker in (self.a, self.b):
            picker.on_update(self._choose)

    def update(self, view: ViewState) -> None:
        """Shows the two runs, and their differences as far as known."""
        drawn = (view.shown, view.ghost, view.comparing, view.run_list.recent, view.status.run_id)
        if drawn == self._drawn:
            return
        self._drawn = drawn
        self._show_choices(view)
        self.findings.content = compare_html(view)

    def _show_choices(self, view: ViewState) -> None:
        on_screen = view.shown.replay if view.shown else None
        pale = view.ghost.shown.replay if view.ghost else None
        labels = {run.id: _choice_label(run) for run in view.run_list.recent}
        for replay in (on_screen, pale):
            if replay is not None and replay.run_id:
                labels.setdefault(
                    replay.run_id, f"{_shortened(replay.name, _LONGEST_NAME)} · {replay.run_id}"
                )
        self._ids = {label: run_id for run_id, label in labels.items()}
        # A ghost that was not selected here, such as the run before a change, is listed too.
        unsaved = view.ghost.label if view.ghost and pale is None else NONE
        for picker, firsts, replay in (
            (self.a, (ON_SCREEN,), on_screen),
            (self.b, tuple(dict.fromkeys((unsaved, NONE))), pale),
        ):
            options = (*firsts, *self._ids)
            if options != picker.options:
                picker.options = options
            picker.value = labels.get(replay.run_id, firsts[0]) if replay else firsts[0]

    async def _choose(self, event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
        # Values that the program sets have no client, and are ignored.
        if event.client_id is not None:
            a, b = (self._ids.get(picker.value, "") for picker in (self.a, self.b))
            self._send(CompareRuns(a, b))


def compare_html(view: ViewState) -> str:
    """The two runs, and their differences."""
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
    """The letter of a run, with its name and outcome."""
    headline = "Measured data" if shown.is_measured else headline_of(shown.result)
    return (
        f"<div class='sg-run {'' if letter == 'A' else 'sg-pale'}'><span>{letter}</span>"
        f"<div><b>{escape(name)}</b><br>{escape(headline)}</div></div>"
    )


def _actions_html(view: ViewState) -> str:
    findings = view.comparing.findings
    first = None if findings is None else first_divergence(findings)
    return (
        "<div class='sg-actions'>"
        + _button("⇥ First difference", first is not None, Seek(first or 0.0))
        + _button("⇄ Swap", can_swap(view), SwapRuns())
        + _button("✕ End", True, EndComparison())
        + "</div>"
    )


def _button(words: str, is_offered: bool, intent: Intent) -> str:
    off = "" if is_offered else "disabled"
    return (
        f"<button {click_attribute(intent)} title='{_HINTS[type(intent)]}' {off}>{words}</button>"
    )


def _body_html(view: ViewState, shown: Shown) -> str:
    """The differences; those of another pair stay dimmed until they are replaced."""
    findings, is_current = view.comparing.findings, view.comparing.pair == pair_of(view)
    if view.comparing.distances is not None and is_current:
        return distances_html(view.comparing.distances)
    if findings is None:
        return "" if is_current else "<p>Comparing …</p>"
    names = shown.result.scenario.finger_names
    if len(names) != len(findings.metrics.get("slip_path", (names,))[0]):
        return "<p>Comparing …</p>"
    # Differences of another pair may be about other unknowns.
    unknowns = _common_unknowns(view) if is_current else ()
    body = findings_html(findings, names, unknowns, shown.result.scenario.space)
    return body if is_current else f"<div class='sg-outdated'>{body}</div>"


def _common_unknowns(view: ViewState) -> tuple[str, ...]:
    """Unknowns that both runs estimate; empty if they differ."""
    runs = [shown for shown in (view.shown, view.ghost and view.ghost.shown) if shown]
    lists = {tuple(e.parameter for e in each.result.scenario.estimates) for each in runs}
    return lists.pop() if len(lists) == 1 else ()


def _choice_label(run: StoredRun) -> str:
    words = row_words(run)
    moment = moment_words(run.created).removesuffix(" UTC")
    return f"{_shortened(words.label, _LONGEST_NAME)} · {words.outcome} · {moment} · {run.id}"


def _shortened(text: str, longest: int) -> str:
    return text if len(text) <= longest else f"{text[: longest - 1].rstrip()}…"


def first_divergence(findings: Comparison) -> float | None:
    """Time of the first difference of a column [s]; None if there is none."""
    return next(iter(findings.first_divergence.values()), None)


def findings_html(
    findings: Comparison,
    names: Sequence[str],
    unknowns: Sequence[str] = (),
    space: Space = PLANAR,
) -> str:
    """The differences between two runs, the most important first.

    Args:
        findings: The comparison of the run on the screen, A, and the ghost, B.
        names: Names of the fingers.
        unknowns: Dotted keys of the common unknowns; empty if they differ.
        space: Kind of hand.
    """
    if findings.identical:
        return "<p><b>Identical.</b> The scenario and all numbers are equal.</p>"
    parameters = (
        _parameter_row(difference, _parameter_words(difference, names, unknowns, space))
        for difference in findings.scenario
    )
    blocks = (
        _outcome_html(findings, names),
        _table_html("Parameters", ("A", "B"), parameters),
        _table_html("Metrics", ("A", "B", _DIFFERENCE), _metric_rows(findings, names)),
        _phases_html(findings, names),
        _signals_html(findings, names),
        _extent_html(findings),
    )
    return "".join(blocks)


def _outcome_html(findings: Comparison, names: Sequence[str]) -> str:
    if findings.equal:
        return f"<p><b>Equal</b> within {_limit(findings)}.</p>"
    first = first_divergence(findings)
    phase = min(map(_begin, findings.phase_changes), default=None)
    sentences = []
    if first is not None:
        differing = len(findings.first_divergence)
        sentences.append(
            f"They first differ at {_moment(first)}; {differing} of {len(findings.signals)} "
            f"columns differ by more than {_limit(findings)}."
        )
    if (error := findings.integration_error) is not None:
        column = escape(column_words(findings.signals[error.column], names))
        largest = f"the largest {amount(error.max, error.unit)} in {column}"
        sentences.append(
            f"Differences before {_moment(error.before)}, {largest}, are integration error."
        )
    if phase is not None:
        sentences.append(f"Phases first differ at {_moment(phase)}.")
    return f"<p>{' '.join(sentences) or '<b>They end differently.</b>'}</p>"


def _limit(findings: Comparison) -> str:
    return "the integration error" if findings.tolerance is None else f"{findings.tolerance:g}"


def _begin(change: PhaseDifference) -> float:
    return min(time for time in (change.a, change.b) if time is not None)


def _moment(time: float) -> str:
    """A time that moves the play head when clicked."""
    words = time_words(time)
    seeking = clickable(f"Put the play head at {words}", Seek(time))
    return f"<span class='sg-time' {seeking}>{words}</span>"


def _table_html(title: str, heads: Sequence[str], rows: Iterable[str]) -> str:
    """A table; empty without rows."""
    body = "".join(rows)
    if not body:
        return ""
    cells = "".join(f"<th>{head}</th>" for head in heads)
    return f"<table><tr><th>{title}</th>{cells}</tr>{body}</table>"


def _row_html(head: str, cells: Iterable[str], kind: str = "") -> str:
    """A row of text and complete cells, all in HTML."""
    return f"<tr class='{kind}'><th>{head}</th>{''.join(cells)}</tr>"


def _cells(*contents: str) -> Iterator[str]:
    return (f"<td>{content}</td>" for content in contents)


def _parameter_row(difference: ParameterDifference, words: str) -> str:
    values = (
        _shortened(value_words(value), _LONGEST_VALUE) for value in (difference.a, difference.b)
    )
    return _row_html(escape(words), (f"<td class='sg-text'>{escape(v)}</td>" for v in values))


def _parameter_words(
    difference: ParameterDifference, names: Sequence[str], unknowns: Sequence[str], space: Space
) -> str:
    """Name of a parameter with unit; estimates have the name of their parameter."""
    head, *rest = difference.key.split(".")
    if head != "estimates" or not unknowns:
        words = key_words(difference.key, names, space)
        return words + unit_words(difference.unit)
    unknown = unknowns[int(rest[0])]
    template = find_template(unknown)
    words = estimate_words(rest[1], key_words(unknown, names))
    return words + unit_words(template.unit if template else "")


def _metric_rows(findings: Comparison, names: Sequence[str]) -> Iterator[str]:
    for name, (a, b) in findings.metrics.items():
        words, unit = metric_words(name)
        if not isinstance(a, tuple):
            yield _single_row(words, unit, a, b)
        elif _PER[name] == "coordinate":
            # Without a hand there is no desired pose.
            yield f"<tr><th colspan='4'>{words}</th></tr>" * bool(a)
            yield from _coordinate_rows(name, a, b) if a else ()
        elif a or b:
            scale = scale_of(unit, filter(None, (*a, *b)))
            yield f"<tr><th colspan='4'>{words} [{scale.unit}]</th></tr>"
            # A hand with hard fingertips has no spins.
            both = (values or (None,) * len(names) for values in (a, b))
            for finger, mine, other in zip(names, *both, strict=True):
                yield _amounts_row(escape(finger), scale, mine, other, is_member=True)


def _single_row(words: str, unit: str, a: Any, b: Any) -> str:
    if not _is_amount(a) or not _is_amount(b):
        cells = _cells(escape(value_words(a)), escape(value_words(b)), "")
        return _row_html(words, cells, "sg-same" if a == b else "")
    scale = scale_of(unit, [value for value in (a, b) if value is not None])
    shown = f"{words} [{scale.unit}]" if scale.unit else words
    return _amounts_row(shown, scale, a, b)


def _is_amount(value: Any) -> bool:
    """Whether a value is a number, or None for a missing one."""
    return value is None or (isinstance(value, (int, float)) and not isinstance(value, bool))


def _coordinate_rows(name: str, a: tuple[float, ...], b: tuple[float, ...]) -> Iterator[str]:
    for (letter, unit), mine, other in zip(coordinate_words(name, len(a)), a, b, strict=True):
        scale = scale_of(unit)
        yield _amounts_row(f"{letter} [{scale.unit}]", scale, mine, other, is_member=True)


def _amounts_row(
    head: str, scale: Scale, a: float | None, b: float | None, *, is_member: bool = False
) -> str:
    """Two amounts with proportional bars, and their difference."""
    largest = max(abs(a or 0.0), abs(b or 0.0), METRIC_ACCURACY)
    difference = (
        "" if a is None or b is None or a == b else scaled_metric(scale, b - a, signed=True)
    )
    cells = (*(_amount_cell(scale, value, largest) for value in (a, b)), *_cells(difference))
    kinds = [*["sg-member"] * is_member, *["sg-same"] * (a == b)]
    return _row_html(head, cells, " ".join(kinds))


def _amount_cell(scale: Scale, value: float | None, largest: float) -> str:
    if value is None:
        return f"<td>{MISSING}</td>"
    part = abs(value) / largest
    return f"<td class='sg-amount' style='--sg-part:{part:.3f}'>{scaled_metric(scale, value)}</td>"


def _phases_html(findings: Comparison, names: Sequence[str]) -> str:
    """Phase changes that moved, or that are in one run only."""
    changes = findings.phase_changes
    rows = [_phase_row(change, names) for change in changes[:MOST_PHASE_CHANGES]]
    if hidden := len(changes) - len(rows):
        rows.append(_row_html(f"and {hidden} more", ()))
    return _table_html("Stick and slip", ("A", "B", _DIFFERENCE), rows)


def _phase_row(change: PhaseDifference, names: Sequence[str]) -> str:
    marks = " → ".join(
        f"<span style='color:{css(PHASES[phase])}' title='{PHASE_HINTS[phase]}'>■</span>"
        for phase in (change.from_phase, change.to_phase)
    )
    times = (MISSING if t is None else _moment(t) for t in (change.a, change.b))
    moved = change.time_difference
    later = MISSING if moved is None else amount(moved, "s", signed=True)
    return _row_html(f"{escape(names[change.contact])} {marks}", _cells(*times, later))


def _signals_html(findings: Comparison, names: Sequence[str]) -> str:
    """For each signal, the column with the largest difference: amount and time."""
    rows = (_signal_row(column, names) for column in findings.largest_differences)
    table = _table_html("", ("largest", "rms", "at"), rows)
    summary = "<summary>Largest differences, signal by signal</summary>"
    return f"<details>{summary}{table}</details>" if table else ""


def _signal_row(column: SignalDifference, names: Sequence[str]) -> str:
    scale = scale_of(column.unit)
    words = column_words(column, names) + (f" [{scale.unit}]" if scale.unit else "")
    apart = (scaled(scale, value) for value in (column.max, column.rms))
    return _row_html(escape(words), _cells(*apart, _moment(column.time_of_max)))


def distances_html(found: Distances) -> str:
    """Deviations of measured data from the displayed run, by signal."""
    rows = (_distance_row(distance) for distance in found.signals.values())
    samples = max(distance.samples for distance in found.signals.values())
    start, end = found.span
    words = f"At {samples} measured times, {time_words(start)} to {time_words(end)}."
    if found.only_measured:
        words += f" The run has no {', '.join(found.only_measured)}."
    title = "Run minus measured"
    table = _table_html(title, ("mean", "rms", "largest", "at"), rows)
    return f"{table}<p class='sg-small'>{escape(words)}</p>"


def _distance_row(distance: SignalDistance) -> str:
    scale = scale_of(distance.unit)
    unit = f" [{scale.unit}]" if scale.unit else ""
    mean = scaled(scale, distance.mean, signed=True)
    apart = (scaled(scale, value) for value in (distance.rms, distance.max))
    cells = _cells(mean, *apart, _moment(distance.time_of_max))
    return _row_html(escape(f"{distance.name}{unit}"), cells)


def _extent_html(findings: Comparison) -> str:
    """Compared time range, and signals of only one run."""
    start, end = findings.span
    words = (
        f"Compared at {findings.num_instants} common instants, "
        f"{time_words(start)} to {time_words(end)}."
    )
    for run, missing in (("A", findings.only_a), ("B", findings.only_b)):
        if missing:
            words += f" Only {run} has {', '.join(missing)}."
    return f"<p class='sg-small'>{escape(words)}</p>"
