"""A comparison as text for the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any

from slipgrasp.cli.tables import table_lines
from slipgrasp.core.scenario.parameters import ParameterDifference
from slipgrasp.core.words.parameter_words import unit_after
from slipgrasp.recordings.compare.comparison import Comparison
from slipgrasp.recordings.compare.differences import PhaseDifference
from slipgrasp.recordings.compare.measured import Distances

MOST_DIVERGENCES = 8
MOST_PHASE_CHANGES = 40
MOST_NAMES = 4
LONGEST_TEXT = 32


def describe_distances(found: Distances) -> str:
    """The deviations of measured signals: rms, mean, and the largest with its time."""
    first, last = found.span
    lines = [
        f"Deviation from the measured data, {first:.6g} … {last:.6g} s:",
        f"{'signal':<24} {'rms':>12} {'mean':>12} {'largest':>12}  at [s]",
    ]
    for each in found.signals.values():
        unit = unit_after(each.unit)
        lines.append(
            f"{each.name:<24} {each.rms:>12.6g} {each.mean:>12.6g} {each.max:>12.6g}  "
            f"{each.time_of_max:.6g}{'  ' + unit.strip() if unit else ''}"
        )
    if found.only_measured:
        lines.append(f"only measured: {', '.join(found.only_measured)}")
    return "\n".join(lines)


def describe_differences(comparison: Comparison, fingers: Sequence[str]) -> str:
    """The result, then the differences: parameters, phase changes, columns and metrics.

    Args:
        comparison: The comparison of two runs, a and b.
        fingers: Names of their contacts.
    """
    if comparison.identical and not comparison.contradictions:
        return "Identical: the same scenario, and all numbers are equal."
    blocks = [
        [_outcome(comparison), *_integration_error(comparison), _extent(comparison)],
        [f"Run {run} contradicts itself: {found}." for run, found in comparison.contradictions],
        table_lines([("parameter", "a", "b", ""), *map(_parameter, comparison.scenario)]),
        _phase_changes(comparison, fingers),
        _divergences(comparison),
        _largest(comparison),
        table_lines([("metric", "a", "b"), *_metrics(comparison)]),
        _uncompared(comparison),
    ]
    return "\n\n".join("\n".join(lines) for lines in blocks if lines)


def _outcome(comparison: Comparison) -> str:
    chosen = comparison.tolerance
    tolerance = "the integration error" if chosen is None else f"{chosen:g}"
    if comparison.equal:
        return f"Equal within {tolerance}."
    if comparison.identical:
        return "Identical samples, but the metrics do not agree with them."
    diverging = comparison.first_divergence
    if diverging:
        name, time = next(iter(diverging.items()))
        words = f"from {_time(time)} on ({name} first), {len(diverging)} of "
        return f"Different {words}{len(comparison.signals)} columns beyond {tolerance}."
    return f"Different, though no column differs by more than {tolerance}."


def _integration_error(comparison: Comparison) -> list[str]:
    """Differences before the first differing parameter takes effect."""
    error = comparison.integration_error
    if error is None:
        return []
    amount = f"{error.max:.2g}{unit_after(error.unit)} in {error.column}"
    return [
        f"Differences before {_time(error.before)}, the largest {amount}, are integration error."
    ]


def _extent(comparison: Comparison) -> str:
    start, end = comparison.span
    words = f"Compared at {comparison.num_instants} common instants, {_time(start)} to {_time(end)}"
    ends = comparison.end_times
    if ends[0] != ends[1]:
        words += f"; a ends at {_time(ends[0])}, b at {_time(ends[1])}"
    return words + "."


def _parameter(difference: ParameterDifference) -> list[str]:
    unit = unit_after(difference.unit).strip()
    return [difference.key, _value(difference.a), _value(difference.b), unit]


def _phase_changes(comparison: Comparison, fingers: Sequence[str]) -> list[str]:
    shown = comparison.phase_changes[:MOST_PHASE_CHANGES]
    rows = (_phase_change(change, fingers[change.contact]) for change in shown)
    lines = table_lines([("phase change", "a [s]", "b [s]", "b - a [s]"), *rows])
    if hidden := len(comparison.phase_changes) - len(shown):
        lines.append(f"and {hidden} more")
    return lines


def _phase_change(change: PhaseDifference, finger: str) -> list[str]:
    phases = (phase.label.replace("_", " ") for phase in (change.from_phase, change.to_phase))
    name = f"contact {change.contact} {finger}: " + " to ".join(phases)
    moved = "" if change.time_difference is None else f"{change.time_difference:+.6g}"
    return [name, *("none" if t is None else f"{t:.9g}" for t in (change.a, change.b)), moved]


def _divergences(comparison: Comparison) -> list[str]:
    """The columns that differ first, in time order."""
    groups = groupby(comparison.first_divergence.items(), key=lambda entry: entry[1])
    found = [(time, [name for name, _ in entries]) for time, entries in groups]
    rows = [[_time(time), _some(names)] for time, names in found[:MOST_DIVERGENCES]]
    lines = table_lines([("first at", "column"), *rows], left=(0, 1))
    if hidden := sum(len(names) for _, names in found[MOST_DIVERGENCES:]):
        last = found[-1][0]
        lines.append(f"and {hidden} more columns, the last at {_time(last)}")
    return lines


def _some(names: Sequence[str]) -> str:
    more = len(names) - MOST_NAMES
    return ", ".join(names[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def _largest(comparison: Comparison) -> list[str]:
    rows = (
        [
            c.name,
            f"{c.max:.4g}",
            f"{c.rms:.4g}",
            _time(c.time_of_max),
            unit_after(c.unit).strip(),
        ]
        for c in comparison.largest_differences
    )
    return table_lines([("largest difference", "max", "rms", "at", "unit"), *rows])


def _metrics(comparison: Comparison) -> Iterator[list[str]]:
    for name, (a, b) in comparison.metrics.items():
        if a != b:
            yield [name, _value(a), _value(b)]


def _uncompared(comparison: Comparison) -> list[str]:
    missing = {"a": comparison.only_a, "b": comparison.only_b}
    return [f"Only {run} has {', '.join(names)}." for run, names in missing.items() if names]


def _value(value: Any) -> str:
    if value is None:
        return "none"
    if isinstance(value, (tuple, list)):
        return ", ".join(map(_value, value))
    if isinstance(value, bool) or not isinstance(value, float):
        text = str(value)
        return text if len(text) <= LONGEST_TEXT else f"{text[: LONGEST_TEXT - 1]}…"
    return f"{value:.6g}"


def _time(time: float) -> str:
    return f"{time:.6g} s"
