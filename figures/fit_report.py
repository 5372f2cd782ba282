"""Report of a fit as an HTML page: profiles, residuals, predictions, and missing evidence."""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Iterator, Sequence
from html import escape
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slipgrasp.core.fit.fit import sampled_at
from slipgrasp.core.fit.problem import FitProblem
from slipgrasp.core.fit.report import FitReport, FittedParameter
from slipgrasp.core.trace.signals import Floats
from slipgrasp.core.words.parameter_words import unit_after
from slipgrasp.figures.files import save_figure
from slipgrasp.figures.style import PAGE_WIDTH, add_axes, new_figure, paint, paper_style
from slipgrasp.recordings.file.atomic_file import atomic_file
from slipgrasp.recordings.palette import FINGERS, MARK, MUTED

_PER_ROW = 3
_PANEL_HEIGHT, _ROW_HEIGHT = 34.0, 50.0
_HIGHEST_RISE = 3.0
"""Upper limit of profile plots, in thresholds."""

_STYLE = (
    "body{font:15px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;"
    "color:#222}table{border-collapse:collapse;margin:.5rem 0}td,th{padding:.2rem .7rem;"
    "border-bottom:1px solid #ddd;text-align:left}td.n{text-align:right;"
    "font-variant-numeric:tabular-nums}h2{margin-top:2rem;font-size:1.15rem}"
    "svg{max-width:100%;height:auto}.quiet{color:#666}"
)

Cell = str | float | int | None


def write_fit_page(problem: FitProblem, report: FitReport, path: Path) -> None:
    """Writes the report of a fit as an HTML page without links to other files.

    Args:
        problem: The problem.
        report: The result.
        path: Output file; an existing one is replaced.

    Raises:
        RecordingError: If it cannot be written.
    """
    with atomic_file(path, overwrite=True) as stream:
        stream.write(fit_page(problem, report).encode())


def fit_page(problem: FitProblem, report: FitReport) -> str:
    """The page as text: equal fits give equal pages."""
    sampled = sampled_at(problem, report)
    residuals = np.where(np.isnan(sampled), np.nan, sampled - problem.data.values)
    profiles, over_time = _draw_profiles(report), _draw_residuals(problem, report, residuals)
    body = "\n".join(_sections(problem, report, profiles, over_time))
    title = "Fit of " + ", ".join(report.parameters)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}'
        f"</title><style>{_STYLE}</style></head>\n<body><h1>{escape(title)}</h1>\n{body}\n"
        "</body></html>\n"
    )


def _sections(
    problem: FitProblem, report: FitReport, profiles: str, residuals: str
) -> Iterator[str]:
    yield _summary(report)
    yield "<h2>1 Parameters and their profiles</h2>"
    yield _parameters([p for p in report.parameters.values() if p.key not in _nuisances(problem)])
    yield f"<p>Dashed: rise of chi-squared at the 95 % interval, {report.threshold:.4g}.</p>"
    yield profiles
    yield "<h2>2 Information by contact</h2>" + _contacts(report)
    yield "<h2>3 Coverage by synthetic twins</h2>" + _coverage(report)
    yield "<h2>4 Data that were not fitted</h2>" + _held_out(report)
    yield "<h2>5 Residuals over time</h2>" + _residuals(report) + residuals
    yield "<h2>6 Starts</h2>" + _starts(report)
    yield "<h2>7 Other models</h2>" + _models(report)
    yield "<h2>8 Numbers that the fit changed</h2>" + _changes(problem, report)
    yield "<h2>9 Errors of the measurement</h2>" + _measurement(problem, report)


def _nuisances(problem: FitProblem) -> set[str]:
    return {parameter.key for parameter in problem.parameters if parameter.nuisance}


def _summary(report: FitReport) -> str:
    per_value = report.chi_squared / max(report.degrees_of_freedom, 1.0)
    if not report.explains:
        finding = "The residuals are larger than the noise: the model is incomplete. The intervals "
        finding += "are widened accordingly."
    elif report.noise_is_smaller:
        finding = "The residuals are smaller than the stated noise: the intervals may be too wide."
    else:
        finding = "The residuals are as large as the stated noise."
    return (
        f"<p>Chi-squared per degree of freedom: {per_value:.4g}. {finding} "
        f"{report.evaluations} runs were simulated.</p>"
    )


def _parameters(parameters: Iterable[FittedParameter]) -> str:
    rows = [
        (p.key, p.kind, p.value, p.low, p.high, unit_after(p.unit).strip(), p.note)
        for p in parameters
    ]
    heads = ("parameter", "class", "value", "95 % from", "to", "unit", "")
    return _table(heads, rows)


def _contacts(report: FitReport) -> str:
    rows = [(c.contact, c.slip_time, c.most_used_friction) for c in report.contacts]
    return _table(("contact", "slipped for [s]", "largest |F_t| / F_n"), rows)


def _coverage(report: FitReport) -> str:
    found = report.coverage
    if found is None:
        return _quiet("Not computed; --twins 200 fits twins of these data.")
    rows = [(key, f"{count} of {found.twins}") for key, count in found.covered.items()]
    return _table(("parameter", "95 % intervals that contain the true value"), rows)


def _held_out(report: FitReport) -> str:
    if not report.held_out:
        return _quiet("None were given; --held-out FILE predicts other data.")
    rows = [
        (each.name, each.chi_squared_per_value, s.name, s.rms, each.final[s.name], s.unit)
        for each in report.held_out
        for s in each.signals
    ]
    heads = ("data", "mean square [sigma²]", "signal", "rms", "at the end", "unit")
    return _table(heads, rows)


def _residuals(report: FitReport) -> str:
    rows = [(s.name, s.sigma, s.rms, s.max, s.unit, s.autocorrelation) for s in report.residuals]
    heads = ("signal", "stated noise", "rms", "largest", "unit", "autocorrelation")
    return _table(heads, rows)


def _starts(report: FitReport) -> str:
    ends = ", ".join(f"{end:.6g}" for end in report.starts.chi_squared)
    text = report.starts.sentence.capitalize()
    return f"<p>{text}. Final values of chi-squared of the starts: {ends}.</p>"


def _models(report: FitReport) -> str:
    if not report.models:
        return _quiet("None were compared; --compare KEY frees another parameter.")
    names = list(report.models[0].held_out)
    rows = [
        (", ".join(model.added) or "as fitted", model.chi_squared, *model.held_out.values())
        for model in report.models
    ]
    return _table(("free besides", "chi-squared", *(f"{name} [sigma²]" for name in names)), rows)


def _changes(problem: FitProblem, report: FitReport) -> str:
    rows = [
        (p.key, p.start, report.best[p.key], p.low, p.high, unit_after(p.unit).strip())
        for p in problem.parameters
    ]
    edges = ", ".join(report.on_limit)
    limits = f"At a limit of its range: {edges}." if edges else "None is at a limit of its range."
    heads = ("parameter", "in the scenario", "in the best run", "range from", "to", "unit")
    return _table(heads, rows) + f"<p>{escape(limits)}</p>"


def _measurement(problem: FitProblem, report: FitReport) -> str:
    keys = _nuisances(problem)
    if not keys:
        return _quiet("None were fitted; --nuisance delay,force_bias fits them.")
    return _parameters([p for p in report.parameters.values() if p.key in keys])


def _quiet(text: str) -> str:
    return f'<p class="quiet">{escape(text)}</p>'


def _table(heads: Sequence[str], rows: Iterable[Sequence[Cell]]) -> str:
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    return f"<table><tr>{head}</tr>{body}</table>"


def _cell(value: Cell) -> str:
    if value is None:
        return '<td class="n">–</td>'
    if isinstance(value, str):
        return f"<td>{escape(value)}</td>"
    return f'<td class="n">{value:.6g}</td>'


def _draw_profiles(report: FitReport) -> str:
    parameters = [*report.parameters.values()]
    rows = math.ceil(len(parameters) / _PER_ROW)
    with paper_style():
        figure = new_figure(rows * _ROW_HEIGHT + 6.0)
        for number, parameter in enumerate(parameters):
            row, column = divmod(number, _PER_ROW)
            width = PAGE_WIDTH / _PER_ROW
            place = (column * width + 13.0, row * _ROW_HEIGHT + 5.0)
            axes = add_axes(figure, *place, width - 17.0, _PANEL_HEIGHT)
            _draw_profile(axes, parameter, report.threshold)
    return _svg(figure)


def _draw_profile(axes: Axes, parameter: FittedParameter, threshold: float) -> None:
    values, rises = zip(*parameter.profile, strict=True)
    axes.plot(values, rises, marker="o", markersize=2.2, color=paint(FINGERS[0]))
    axes.axhline(threshold, color=paint(MUTED), linestyle="--", linewidth=0.7)
    for end in (parameter.low, parameter.high):
        if end is not None:
            axes.axvline(end, color=paint(MARK), linewidth=0.7)
    axes.set_ylim(-0.1 * threshold, _HIGHEST_RISE * threshold)
    _frame(axes, parameter, threshold)
    unit = unit_after(parameter.unit)
    axes.set_xlabel(f"{parameter.key}{f' [{unit.strip()}]' if unit else ''}")
    axes.set_ylabel("rise of chi-squared")


def _frame(axes: Axes, parameter: FittedParameter, threshold: float) -> None:
    """Limits the plot to the profile near the threshold."""
    near = [value for value, rise in parameter.profile if rise <= _HIGHEST_RISE * threshold]
    ends = [end for end in (parameter.low, parameter.high) if end is not None]
    low, high = min([*near, *ends]), max([*near, *ends])
    margin = 0.08 * (high - low) or 0.01 * abs(high) or 1.0
    axes.set_xlim(low - margin, high + margin)
    axes.locator_params(axis="x", nbins=4)


def _draw_residuals(problem: FitProblem, report: FitReport, residuals: Floats) -> str:
    data = problem.data
    with paper_style():
        figure = new_figure(len(data.names) * 26.0 + 14.0)
        for k, (name, unit) in enumerate(zip(data.names, data.units, strict=True)):
            axes = add_axes(figure, 22.0, 4.0 + 26.0 * k, PAGE_WIDTH - 28.0, 20.0)
            axes.plot(data.times, residuals[:, k], linewidth=0.5, color=paint(FINGERS[0]))
            for level in (-2.0, 2.0):
                axes.axhline(level * data.sigmas[k], color=paint(MUTED), linewidth=0.5)
            for time in report.events:
                axes.axvline(time, color=paint(MARK), linewidth=0.5, linestyle=":")
            axes.set_ylabel(f"{name} [{unit}]" if unit else name)
            axes.margins(x=0.0)
            if k + 1 < len(data.names):
                axes.set_xticklabels([])
            else:
                axes.set_xlabel("time [s]; grey: two standard deviations, dotted: phase changes")
    return _svg(figure)


def _svg(figure: Figure) -> str:
    stream = io.BytesIO()
    save_figure(figure, stream, "svg")
    text = stream.getvalue().decode()
    return text[text.index("<svg") :]
