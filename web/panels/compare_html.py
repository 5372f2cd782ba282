"""A comparison of two runs as HTML; everything that could come from outside is escaped."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from html import escape
from typing import Any

from slipgrasp.core.run.metrics import METRICS
from slipgrasp.core.scenario.field_errors import template_key, template_keys
from slipgrasp.core.scenario.parameters import ParameterDifference
from slipgrasp.core.words.parameter_words import belief_words, key_words, unit_words
from slipgrasp.recordings.compare.comparison import Comparison
from slipgrasp.recordings.compare.differences import PhaseDifference, SignalDifference
from slipgrasp.recordings.palette import PHASES
from slipgrasp.web.model.colours import css
from slipgrasp.web.model.compare_words import (
    MISSING,
    Scale,
    amount,
    column_words,
    coordinate_words,
    metric_words,
    number,
    scale_of,
    time_words,
    value_words,
)
from slipgrasp.web.model.words import PHASE_HINTS
from slipgrasp.web.page.markup import clickable

MOST_PHASE_CHANGES = 12

_PER = {metric.name: metric.per for metric in METRICS}
_LONGEST_VALUE = 40
_DIFFERENCE = "B − A"


def first_divergence(findings: Comparison) -> float | None:
    """When the first column differs [s]; None if none does."""
    return next(iter(findings.first_divergence.values()), None)


def findings_html(findings: Comparison, names: Sequence[str], unknowns: Sequence[str] = ()) -> str:
    """What tells two runs apart, the most important first.

    Args:
        findings: The comparison of the run on the screen, A, and the pale one, B.
        names: What the fingers are called.
        unknowns: Dotted keys of what both runs estimate; empty if that is not the same.
    """
    if findings.identical:
        return "<p><b>Identical.</b> The same scenario, and not one number differs.</p>"
    parameters = (_parameter_row(difference, names, unknowns) for difference in findings.scenario)
    blocks = (
        _verdict_html(findings, names),
        _table_html("What was set", ("A", "B"), parameters),
        _table_html("How it went", ("A", "B", _DIFFERENCE), _metric_rows(findings, names)),
        _phases_html(findings, names),
        _signals_html(findings, names),
        _extent_html(findings),
    )
    return "".join(blocks)


def _verdict_html(findings: Comparison, names: Sequence[str]) -> str:
    if findings.equal:
        return f"<p><b>The same happened</b>, within {_limit(findings)}.</p>"
    first = first_divergence(findings)
    phase = min(map(_begin, findings.phase_changes), default=None)
    sentences = []
    if first is not None:
        differing = len(findings.first_divergence)
        sentences.append(
            f"They part at {_moment(first)}; {differing} of {len(findings.signals)} "
            f"signals differ by more than {_limit(findings)}."
        )
    if (error := findings.integration_error) is not None:
        column = escape(column_words(findings.signals[error.column], names))
        largest = f"the largest {amount(error.max, error.unit)} in {column}"
        sentences.append(
            f"Differences before {_moment(error.before)}, {largest}, are integration error."
        )
    if phase is not None:
        sentences.append(f"Stick and slip first differ at {_moment(phase)}.")
    return f"<p>{' '.join(sentences) or '<b>They end differently.</b>'}</p>"


def _limit(findings: Comparison) -> str:
    return "the integration error" if findings.tolerance is None else f"{findings.tolerance:g}"


def _begin(change: PhaseDifference) -> float:
    return min(time for time in (change.a, change.b) if time is not None)


def _moment(time: float) -> str:
    """A time that puts the play head there when it is clicked."""
    words = time_words(time)
    seeking = clickable(f"Put the play head at {words}", "seek", time=time)
    return f"<span class='sg-time' {seeking}>{words}</span>"


def _table_html(title: str, heads: Sequence[str], rows: Iterable[str]) -> str:
    """A table; nothing without rows."""
    body = "".join(rows)
    if not body:
        return ""
    cells = "".join(f"<th>{head}</th>" for head in heads)
    return f"<table><tr><th>{title}</th>{cells}</tr>{body}</table>"


def _row_html(head: str, cells: Iterable[str], kind: str = "") -> str:
    """A row of words and whole cells, all of it HTML already."""
    return f"<tr class='{kind}'><th>{head}</th>{''.join(cells)}</tr>"


def _cells(*contents: str) -> Iterator[str]:
    return (f"<td>{content}</td>" for content in contents)


def _parameter_row(
    difference: ParameterDifference, names: Sequence[str], unknowns: Sequence[str]
) -> str:
    words = _parameter_words(difference, names, unknowns)
    values = (_shortened(value_words(value)) for value in (difference.a, difference.b))
    return _row_html(escape(words), (f"<td class='sg-text'>{escape(v)}</td>" for v in values))


def _parameter_words(
    difference: ParameterDifference, names: Sequence[str], unknowns: Sequence[str]
) -> str:
    """What a parameter is called, with its unit; a belief as what it is about."""
    head, *rest = difference.key.split(".")
    if head != "estimates" or not unknowns:
        return key_words(difference.key, names) + unit_words(difference.unit)
    unknown = unknowns[int(rest[0])]
    unit = template_keys()[template_key(unknown)].unit
    return belief_words(rest[1], key_words(unknown, names)) + unit_words(unit)


def _shortened(text: str) -> str:
    return text if len(text) <= _LONGEST_VALUE else f"{text[: _LONGEST_VALUE - 1].rstrip()}…"


def _metric_rows(findings: Comparison, names: Sequence[str]) -> Iterator[str]:
    for name, (a, b) in findings.metrics.items():
        words, unit = metric_words(name)
        if not isinstance(a, tuple):
            yield _single_row(words, unit, a, b)
        elif _PER[name] == "coordinate":
            yield f"<tr><th colspan='4'>{words}</th></tr>"
            yield from _coordinate_rows(name, a, b)
        else:
            scale = scale_of(unit, filter(None, (*a, *b)))
            yield f"<tr><th colspan='4'>{words} [{scale.unit}]</th></tr>"
            for finger, mine, other in zip(names, a, b, strict=True):
                yield _amounts_row(escape(finger), scale, mine, other, is_member=True)


def _single_row(words: str, unit: str, a: Any, b: Any) -> str:
    if not _is_amount(a) or not _is_amount(b):
        cells = _cells(escape(value_words(a)), escape(value_words(b)), "")
        return _row_html(words, cells, "sg-same" if a == b else "")
    scale = scale_of(unit, [value for value in (a, b) if value is not None])
    shown = f"{words} [{scale.unit}]" if scale.unit else words
    return _amounts_row(shown, scale, a, b)


def _is_amount(value: Any) -> bool:
    """Whether it is a number, or stands for one that there is not."""
    return value is None or (isinstance(value, (int, float)) and not isinstance(value, bool))


def _coordinate_rows(name: str, a: tuple[float, ...], b: tuple[float, ...]) -> Iterator[str]:
    for (letter, unit), mine, other in zip(coordinate_words(name), a, b, strict=True):
        scale = scale_of(unit)
        yield _amounts_row(f"{letter} [{scale.unit}]", scale, mine, other, is_member=True)


def _amounts_row(
    head: str, scale: Scale, a: float | None, b: float | None, *, is_member: bool = False
) -> str:
    """Two amounts, each over a bar as long as it is large, and their difference."""
    largest = max(abs(a or 0.0), abs(b or 0.0))
    difference = "" if a is None or b is None or a == b else _times(scale, b - a, signed=True)
    cells = (*(_amount_cell(scale, value, largest) for value in (a, b)), *_cells(difference))
    kinds = [*["sg-member"] * is_member, *["sg-same"] * (a == b)]
    return _row_html(head, cells, " ".join(kinds))


def _amount_cell(scale: Scale, value: float | None, largest: float) -> str:
    if value is None:
        return f"<td>{MISSING}</td>"
    part = abs(value) / largest if largest else 0.0
    return f"<td class='sg-amount' style='--sg-part:{part:.3f}'>{_times(scale, value)}</td>"


def _times(scale: Scale, value: float, *, signed: bool = False) -> str:
    is_count = isinstance(value, int)
    return number(value if is_count else scale.factor * value, signed=signed, padded=not is_count)


def _phases_html(findings: Comparison, names: Sequence[str]) -> str:
    """The phase changes that moved, or that only one run has."""
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
    """Of each signal the column that differs most: how far, and when."""
    rows = (_signal_row(column, names) for column in findings.largest_differences)
    table = _table_html("", ("largest", "rms", "at"), rows)
    summary = "<summary>Largest differences, signal by signal</summary>"
    return f"<details>{summary}{table}</details>" if table else ""


def _signal_row(column: SignalDifference, names: Sequence[str]) -> str:
    scale = scale_of(column.unit)
    words = column_words(column, names) + (f" [{scale.unit}]" if scale.unit else "")
    apart = (_times(scale, value) for value in (column.max, column.rms))
    return _row_html(escape(words), _cells(*apart, _moment(column.time_of_max)))


def _extent_html(findings: Comparison) -> str:
    """How long the runs were compared, and what only one of them has."""
    start, end = findings.span
    words = (
        f"Compared at the {findings.num_instants} instants that both have stored, "
        f"{time_words(start)} to {time_words(end)}."
    )
    for run, missing in (("A", findings.only_a), ("B", findings.only_b)):
        if missing:
            words += f" Only {run} has {', '.join(missing)}."
    return f"<p class='sg-small'>{escape(words)}</p>"
