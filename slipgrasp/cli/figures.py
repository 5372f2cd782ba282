"""``slipgrasp figures``: the paper's figures of a scenario or a recording."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from slipgrasp.cli.progress import Progress, load_simulation
from slipgrasp.cli.status import CommandError, ExitStatus

if TYPE_CHECKING:
    from slipgrasp.core.run.result import RunResult
    from slipgrasp.core.scenario import Scenario
    from slipgrasp.recordings.measured.recording import MeasuredRecording

FORMATS = ("svg", "pdf", "png")
RECORDING_SUFFIX = ".mcap"
_SIGNALS = "signals"
NAME = "figures"
HELP = "draw the paper's figures of a scenario or a recording"
DESCRIPTION = (
    "Draw the schematic of a scenario (the paper's Fig. 4), and the tracking errors and slips, the "
    "estimates, and the joint torques and contact forces of its run (Fig. 5-7 for case I, 8-10 for "
    "case II). Coloured lanes show the phases of the contacts. For a spatial hand, the slips in "
    "the planes of the faces replace the schematic. Runs of theorem-3 and theorem-4 with constant "
    "parameters also get a figure of the assumptions of the theorems."
)
EPILOG = (
    "The command replaces its earlier figures; it replaces other files only with --force. A run "
    "that ended early is drawn up to its end, with its outcome. Exit status: 0 drawn, 2 bad input."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument(
        "source",
        metavar="SOURCE",
        help="name of a preset, a TOML file, or a recording (FILE.mcap)",
    )
    parser.add_argument(
        "--output",
        metavar="DIR",
        type=Path,
        help="folder for the figures, created if missing "
        "(default: NAME-figures in the current folder)",
    )
    parser.add_argument(
        "--format",
        dest="formats",
        metavar="LIST",
        type=_formats,
        default=FORMATS,
        help="formats to write, separated by commas (default: svg,pdf,png)",
    )
    parser.add_argument(
        "--signals",
        metavar="LIST",
        type=lambda text: [word.strip() for word in text.split(",")],
        help="draw these signals over time instead, such as slip,normal_force_0",
    )
    parser.add_argument(
        "--over",
        metavar="SOURCE",
        help="with --signals: a second run (preset, TOML file or recording), drawn dashed, or "
        "measured data ('slipgrasp import'), drawn as dots",
    )
    parser.add_argument(
        "--time", metavar="START,END", type=_time, help="with --signals: time range of the run [s]"
    )
    parser.add_argument(
        "--title",
        metavar="TEXT",
        help="with --signals: title above the figure (at most 100 characters)",
    )
    parser.add_argument("--force", action="store_true", help="replace existing files")


def _formats(text: str) -> tuple[str, ...]:
    chosen = tuple(dict.fromkeys(word.strip().lower() for word in text.split(",")))
    wrong = [word for word in chosen if word not in FORMATS]
    if wrong:
        raise argparse.ArgumentTypeError(f"unknown format '{wrong[0]}'; use {', '.join(FORMATS)}")
    return chosen


def _time(text: str) -> tuple[float, float]:
    try:
        start, end = map(float, text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text}' is not START,END in seconds") from None
    return start, end


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    source = Path(arguments.source)
    folder = arguments.output or Path(f"{source.stem}-figures")
    options = (arguments.over, arguments.time, arguments.title)
    if not arguments.signals and any(option is not None for option in options):
        raise CommandError("--over, --time and --title need --signals, such as --signals slip")
    run = _run_of(arguments.source)
    with Progress("loading the drawing program"):
        from slipgrasp.figures.drawings import draw_figures
        from slipgrasp.figures.files import check_folder, write_figures
        from slipgrasp.figures.signals import draw_signals
    names = _names(arguments, run.scenario)
    check_folder(folder, names, arguments.formats, overwrite=arguments.force)
    result = run.result()
    over = _over(arguments.over) if arguments.over else None
    with Progress("drawing the figures"):
        if arguments.signals:
            window, title = arguments.time, arguments.title
            drawn = draw_signals(result, arguments.signals, over=over, time=window, title=title)
            figures = {_SIGNALS: drawn}
        else:
            figures = draw_figures(result)
        paths = write_figures(figures, folder, arguments.formats, overwrite=arguments.force)
    for path in paths:
        print(path)
    return ExitStatus.COMPLETED


def _names(arguments: argparse.Namespace, scenario: Scenario) -> Collection[str]:
    """Names of the figures."""
    from slipgrasp.figures.drawings import figure_names

    return (_SIGNALS,) if arguments.signals else figure_names(scenario).values()


def _over(source: str) -> RunResult | MeasuredRecording:
    """The second run of a figure, or measured data."""
    path = Path(source)
    if path.suffix.lower() not in (RECORDING_SUFFIX, ".csv"):
        return _run_of(source).result()
    from slipgrasp.recordings.measured.recording import is_measured, read_measured

    return read_measured(path) if is_measured(path) else _read(path)


class _Run(NamedTuple):
    """A scenario and its run, which is simulated only if needed."""

    scenario: Scenario
    result: Callable[[], RunResult]


def _run_of(source: str) -> _Run:
    """The run of a recording, or of a preset or scenario file."""
    path = Path(source)
    if path.suffix.lower() == RECORDING_SUFFIX:
        recorded = _read(path)
        return _Run(recorded.scenario, lambda: recorded)
    from slipgrasp.core.scenario.loading import load_scenario

    scenario = load_scenario(source)
    return _Run(scenario, lambda: _simulate(scenario))


def _read(path: Path) -> RunResult:
    from slipgrasp.recordings.file.reader import read_recording

    with Progress("reading the recording"):
        return read_recording(path)


def _simulate(scenario: Scenario) -> RunResult:
    from slipgrasp.core.run.simulator import simulate

    load_simulation(scenario)
    with Progress("simulating") as progress:
        return simulate(scenario, progress=progress.update)
