"""``slipgrasp margin``: find the range of a parameter over which the grasp holds."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from slipgrasp.cli.arguments import (
    add_data_directory,
    add_scenario,
    read_scenario,
    refuse_existing,
    store_in,
)
from slipgrasp.cli.progress import Progress, load_simulation
from slipgrasp.cli.status import CommandError, ExitStatus, complain

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from slipgrasp.core.run.result import RunResult
    from slipgrasp.core.study.margin import Margin, MarginError

NAME = "margin"
HELP = "find the range of a parameter over which the grasp holds"
DESCRIPTION = (
    "Find the boundary of the range of a parameter over which the grasp holds the object. The "
    "command simulates the values --from and --to and some between them, then bisects, and stores "
    "the recordings of the runs on both sides of the boundary."
)
EPILOG = (
    "exit status: 0 found, 1 held at both ends or at neither (nothing saved), 2 bad input, "
    "4 interrupted or disk failure"
)
HELD, LOST = "held.mcap", "lost.mcap"
_VISIBLE_TURN = 0.5  # [°]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    add_scenario(parser)
    parser.add_argument(
        "--over",
        dest="key",
        metavar="KEY",
        required=True,
        help="a numeric parameter, such as object.mass; fingers.*.friction for all fingers",
    )
    for name, dest in (("--from", "start"), ("--to", "stop")):
        parser.add_argument(
            name,
            dest=dest,
            metavar="VALUE",
            type=_number,
            required=True,
            help="one end of the range" if dest == "start" else "the other end, larger or smaller",
        )
    parser.add_argument(
        "--tolerance",
        metavar="SHARE",
        type=_number,
        help="largest distance between the two sides of the boundary, as a fraction of the range "
        "(default: 0.001)",
    )
    parser.add_argument(
        "--slip",
        dest="most_slip",
        metavar="METRES",
        type=_number,
        default=math.inf,
        help="slip of any fingertip above which the object counts as not held, such as 0.001 "
        "(default: any slip that ends is allowed); rotation of the object is not limited",
    )
    parser.add_argument(
        "--output",
        metavar="DIR",
        type=Path,
        help=f"folder for {HELD} and {LOST}, created if missing "
        "(default: new runs in the data folder)",
    )
    parser.add_argument("--force", action="store_true", help="replace these files in --output")
    parser.add_argument("--json", action="store_true", help="print the result as one JSON object")
    add_data_directory(parser)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{text[:20]}' is not a number") from None


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    from slipgrasp.core.study.parameter_range import ParameterRange

    scenario = read_scenario(arguments)
    # This fails before the simulation is loaded, which takes a second.
    ParameterRange.of(scenario, arguments.key, arguments.start, arguments.stop)
    place = _find_place(arguments)
    load_simulation(scenario)
    from slipgrasp.core.study.margin import DEFAULT_TOLERANCE, MarginError, find_margin

    tolerance: float | None = arguments.tolerance
    try:
        with Progress("searching") as progress:
            margin = find_margin(
                scenario,
                arguments.key,
                arguments.start,
                arguments.stop,
                tolerance=DEFAULT_TOLERANCE if tolerance is None else tolerance,
                most_slip=arguments.most_slip,
                progress=progress.update,
            )
    except MarginError as error:
        return _report_nothing_found(error, arguments)
    recordings = [_keep(place.held, margin.held), _keep(place.lost, margin.lost)]
    if arguments.json:
        print(json.dumps({**margin.to_mapping(), "recordings": recordings}, allow_nan=False))
    else:
        print("\n".join(_lines(margin, recordings)))
    return ExitStatus.ENDED_EARLY if None in recordings else ExitStatus.COMPLETED


@dataclass(frozen=True, slots=True)
class _Place:
    """Functions that store the runs on both sides, and return their paths."""

    held: Callable[[RunResult], Path]
    lost: Callable[[RunResult], Path]


def _find_place(arguments: argparse.Namespace) -> _Place:
    """Checks before the simulation whether the runs can be saved."""
    output: Path | None = arguments.output
    if output is None:
        store = store_in(arguments.data_directory)
        store.prepare()

        def save(result: RunResult) -> Path:
            return store.save(result).path.absolute()

        return _Place(save, save)
    _prepare_folder(output, arguments.force)
    held, lost = (
        partial(_write, path=output.absolute() / name, overwrite=arguments.force)
        for name in (HELD, LOST)
    )
    return _Place(held, lost)


def _prepare_folder(folder: Path, force: bool) -> None:
    for name in (HELD, LOST):
        refuse_existing(folder / name, force)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        message = f"--output '{folder}': cannot create the folder: {error.strerror}"
        raise CommandError(message) from error


def _write(result: RunResult, *, path: Path, overwrite: bool) -> Path:
    from slipgrasp.recordings.file.writer import write_recording

    write_recording(result, path, overwrite=overwrite)
    return path


def _keep(save: Callable[[RunResult], Path], result: RunResult) -> str | None:
    """The path of the recording; if the disk fails, the result is still printed."""
    from slipgrasp.recordings.exceptions import RecordingError

    try:
        return str(save(result))
    except RecordingError as error:
        complain(f"a run is not saved: {error}")
        return None


def _report_nothing_found(error: MarginError, arguments: argparse.Namespace) -> ExitStatus:
    complain(f"{arguments.key} is {error}")
    if arguments.json:
        document = {"key": arguments.key, **error.to_mapping(), "recordings": []}
        print(json.dumps(document, allow_nan=False))
    return ExitStatus.DIFFERENT


def _lines(margin: Margin, recordings: list[str | None]) -> list[str]:
    from slipgrasp.core.run.verdict import headline_of
    from slipgrasp.core.words.knowledge_words import describe_knowledge
    from slipgrasp.core.words.parameter_words import unit_after

    held, lost = (path or "not saved" for path in recordings)
    unit = unit_after(margin.unit)
    rows = [
        ("key", margin.key),
        ("held at", f"{margin.held_at:.10g}{unit}"),
        (f"{margin.beyond} at", f"{margin.lost_at:.10g}{unit}"),
        ("outcome", f"{margin.outcome.value}: {margin.reason}"),
        ("recordings", f"{held} ({_first_small(headline_of(margin.held))})"),
        ("", f"{lost} ({_beyond_words(margin)})"),
    ]
    if margin.others:
        places = ", ".join(f"{a:.6g} … {b:.6g}{unit}" for a, b in margin.others)
        rows.append(("warning", f"there are more boundaries, at {places}"))
    rows += [("rotation", words) for words in _rotation_words(margin)]
    known = describe_knowledge(margin.held.scenario)
    rows += [("knowledge", known)] * bool(known)
    width = max(len(label) for label, _ in rows)
    return [f"{label:<{width}}  {text}" for label, text in rows]


def _beyond_words(margin: Margin) -> str:
    """How the run beyond the boundary ended."""
    from slipgrasp.core.run.verdict import headline_of

    words = _first_small(headline_of(margin.lost))
    return f"{margin.beyond}: {words}" if margin.lost.metrics.held else words


def _rotation_words(margin: Margin) -> Iterator[str]:
    """The rotation that does not count, if it is visible."""
    turns = margin.held.metrics.final_tracking_error[margin.held.scenario.space.num_positions :]
    degrees = math.degrees(math.hypot(*turns))
    if degrees >= _VISIBLE_TURN:
        yield (
            f"not limited: where it is held, the object ends {degrees:.1f}° from its target "
            "orientation"
        )


def _first_small(words: str) -> str:
    return words[:1].lower() + words[1:]
