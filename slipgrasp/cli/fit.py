"""``slipgrasp fit``: parameters of a scenario from measured data."""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from slipgrasp.cli.arguments import (
    add_changes,
    add_data_directory,
    read_scenario,
    recording_path,
)
from slipgrasp.cli.import_data import add_map, read_options
from slipgrasp.cli.interrupt import Interrupt
from slipgrasp.cli.progress import Progress, load_simulation
from slipgrasp.cli.status import CommandError, ExitStatus, complain

if TYPE_CHECKING:
    from slipgrasp.core.fit.fit import FitOptions
    from slipgrasp.core.fit.problem import FitProblem, Observations
    from slipgrasp.core.fit.report import FitReport, FittedParameter
    from slipgrasp.core.scenario import Scenario

NAME = "fit"
HELP = "find parameters from measured data, with intervals"
DESCRIPTION = (
    "Find parameters of a scenario from a recording or a table of measured data (docs/fit.md). "
    "Searches start from many points; a profile of each parameter gives its 95 % interval, or "
    "shows that the data do not bound it. The runs, except those of twins, are stored as a study; "
    "a report is written to the same folder as JSON and HTML. The same command continues an "
    "interrupted fit."
)
EPILOG = (
    "exit status: 0 fitted, 1 fitted with residuals larger than the noise, 2 bad input, "
    "4 interrupted or disk failure (repeat the command to continue)"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "data",
        metavar="DATA.csv|FILE.mcap|ID",
        help="a table, a recording of measured data, or a run",
    )
    parser.add_argument(
        "--scenario", metavar="SCENARIO", required=True, help="name of a preset, or a TOML file"
    )
    add_changes(parser)
    parser.add_argument(
        "--free",
        metavar="KEY[=LOW..HIGH],…",
        required=True,
        help="parameters to find, such as object.mass or object.mass=0.5..2; fingers.*.friction "
        "stands for one parameter per finger",
    )
    parser.add_argument(
        "--signals",
        metavar="SIGNAL:NOISE,…",
        required=True,
        help="signals to fit, each with the standard deviation of its noise in SI units, "
        "such as object_pose:3e-4,slip:2e-4",
    )
    _add_search(parser)
    parser.add_argument(
        "--output",
        metavar="FIT.mcap",
        type=Path,
        required=True,
        help="study to write; the report is FIT.json and FIT.html",
    )
    parser.add_argument("--force", action="store_true", help="replace existing files")
    parser.add_argument("--json", action="store_true", help="print the report as one JSON object")
    add_map(parser)
    add_data_directory(parser)


def _add_search(parser: argparse.ArgumentParser) -> None:
    """Adds the options of nuisance parameters, predictions, comparisons and the search."""
    parser.add_argument(
        "--nuisance",
        metavar="delay,force_bias",
        default="",
        help="measurement errors to estimate as well: a delay, a constant error of each force",
    )
    parser.add_argument(
        "--held-out",
        metavar="FILE",
        action="append",
        default=[],
        help="other data to predict with the fitted parameters; may be repeated",
    )
    parser.add_argument(
        "--compare",
        metavar="KEY[=LOW..HIGH],…",
        action="append",
        default=[],
        help="compare the fit with a model in which these parameters are also free; may be "
        "repeated",
    )
    parser.add_argument(
        "--starts",
        metavar="N",
        type=int,
        default=20,
        help="number of points from which the search starts (default: 20)",
    )
    parser.add_argument(
        "--twins",
        metavar="N",
        type=int,
        default=0,
        help="fit N synthetic twins of the data, and count the intervals that contain the true "
        "value",
    )
    parser.add_argument("--seed", metavar="N", type=int, default=0, help="seed of starts and twins")


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    with Progress("reading the data"):
        scenario = read_scenario(arguments)
        with _naming_options():
            problem, options = _read(arguments, scenario)
    load_simulation(scenario)
    from slipgrasp.recordings.fit.journal import FitStoppedError

    try:
        with Interrupt() as interrupt, Progress("fitting") as progress:
            page = arguments.output.with_suffix(".html")
            report = _fit(arguments, problem, options, page, progress, interrupt)
    except FitStoppedError as stopped:
        complain(f"stopped after {stopped.runs} runs; repeat the command to continue")
        return ExitStatus.ENDED_EARLY
    if arguments.json:
        files = {"study": str(arguments.output), "report": str(page)}
        print(json.dumps({**report.to_mapping(), **files}, allow_nan=False))
    else:
        print("\n".join([*_lines(report), f"report     {page}"]))
    return ExitStatus.COMPLETED if report.explains else ExitStatus.DIFFERENT


@contextmanager
def _naming_options() -> Iterator[None]:
    """A context whose errors begin with the wrong option."""
    from slipgrasp.core.fit.problem import FitError

    try:
        yield
    except FitError as error:
        raise CommandError(f"--{error}" if error.field else str(error)) from error


def _read(arguments: argparse.Namespace, scenario: Scenario) -> tuple[FitProblem, FitOptions]:
    from slipgrasp.core.fit.fit import FitOptions
    from slipgrasp.core.fit.problem import FitProblem
    from slipgrasp.recordings.fit.request import read_noise, split

    noise = read_noise(arguments.signals)
    data = _observations(arguments.data, arguments, noise)
    problem = FitProblem.make(scenario, split(arguments.free), data, split(arguments.nuisance))
    held_out = tuple(
        (Path(each).name, _observations(each, arguments, noise)) for each in arguments.held_out
    )
    options = FitOptions(
        starts=arguments.starts,
        seed=arguments.seed,
        twins=arguments.twins,
        held_out=held_out,
        added=tuple(tuple(split(each)) for each in arguments.compare),
    )
    options.check()
    return problem, options


def _observations(
    source: str, arguments: argparse.Namespace, noise: dict[str, float]
) -> Observations:
    from slipgrasp.recordings.fit.run_fit import read_observations

    with _recording(source, arguments) as path:
        return read_observations(path, noise)


@contextmanager
def _recording(source: str, arguments: argparse.Namespace) -> Iterator[Path]:
    """The recording of the data; a table is imported into a temporary one."""
    if not source.lower().endswith((".csv", ".tsv", ".txt")):
        yield recording_path(source, arguments.data_directory)
        return
    from slipgrasp.recordings.measured.csv_import import import_csv

    with tempfile.TemporaryDirectory(prefix="slipgrasp-") as folder:
        path = Path(folder) / "data.mcap"
        import_csv(source, path, read_options(arguments))
        yield path


def _fit(
    arguments: argparse.Namespace,
    problem: FitProblem,
    options: FitOptions,
    page: Path,
    progress: Progress,
    interrupt: Interrupt,
) -> FitReport:
    from slipgrasp.recordings.fit.run_fit import run_fit

    def write_page(report: FitReport) -> None:
        progress.update(1.0, "drawing the report")
        from slipgrasp.figures.fit_report import write_fit_page

        write_fit_page(problem, report, page)

    return run_fit(
        problem,
        arguments.output,
        options,
        overwrite=arguments.force,
        watch=lambda now: progress.update(now.share, now.stage),
        should_stop=lambda: interrupt.requested,
        also_write=write_page,
    )


def _lines(report: FitReport) -> Iterator[str]:
    per_value = report.chi_squared / max(report.degrees_of_freedom, 1.0)
    found = "more than the noise explains"
    if report.explains:
        found = "less than the stated noise" if report.noise_is_smaller else "as the noise explains"
    yield f"chi-squared per degree of freedom {per_value:.4g}: {found}"
    yield f"{report.starts.sentence}; {report.evaluations} runs"
    for parameter in report.parameters.values():
        yield _line(parameter)
    if report.on_limit:
        yield f"at a limit of its range: {', '.join(report.on_limit)}"
    for contact in report.contacts:
        yield f"contact {contact.contact} slipped for {contact.slip_time:.4g} s"
    for held_out in report.held_out:
        yield f"held out: {held_out.name}, mean square {held_out.chi_squared_per_value:.4g} sigma²"
    for model in report.models:
        yield f"model {_model_name(model.added)}: chi-squared {model.chi_squared:.6g}"
    if report.coverage is not None:
        counts = ", ".join(f"{key} {count}" for key, count in report.coverage.covered.items())
        yield f"intervals of {report.coverage.twins} twins that contain the true value: {counts}"


def _model_name(added: Sequence[str]) -> str:
    return f"with {', '.join(added)}" if added else "as fitted"


def _line(parameter: FittedParameter) -> str:
    from slipgrasp.core.words.fit_words import interval_words

    words = interval_words(
        parameter.kind,
        parameter.value,
        parameter.low,
        parameter.high,
        parameter.unit,
        parameter.limits,
    )
    note = f" ({parameter.note})" if parameter.note else ""
    return f"{parameter.key:<24} {parameter.kind:<11} {words}{note}"
