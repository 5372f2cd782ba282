"""``slipgrasp study``: simulate many runs, and map where the object is held."""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipgrasp.cli.arguments import add_data_directory, data_directory, number_in
from slipgrasp.cli.interrupt import Interrupt
from slipgrasp.cli.progress import Progress, load_simulation
from slipgrasp.cli.status import ExitStatus, complain

if TYPE_CHECKING:
    from slipgrasp.cli.study_folder import StudyFolder
    from slipgrasp.core.executors import Executor
    from slipgrasp.core.study.cost import StudyCost
    from slipgrasp.core.study.definition import Study
    from slipgrasp.recordings.study.documents import StudyEnd
    from slipgrasp.recordings.study.results import StudyResults

MAX_WORKERS = 1024
REMOTE = "dask://"
CHECKED_BY_ESTIMATE = 10_000
NAME = "study"
HELP = "simulate many runs, and tabulate and map their outcomes"
DESCRIPTION = (
    "Simulate the runs of a study (docs/studies.md), and store them in one file, study.mcap, with "
    "a table of the results, results.csv. If two numeric parameters vary, map.svg and map.png show "
    "where the object is held. The same command continues an interrupted study."
)
EPILOG = (
    "exit status: 0 every run has an outcome, 2 bad input, 4 interrupted or disk failure "
    "(finished runs are stored)"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of the command."""
    parser.add_argument("study", metavar="FILE.toml", type=Path, help="definition of the study")
    parser.add_argument(
        "--output",
        metavar="DIR",
        type=Path,
        help="folder for the results, created if missing "
        "(default: a new one in the folder 'study-results' of the data folder)",
    )
    parser.add_argument(
        "--executor",
        metavar="WHERE",
        default="processes",
        help="where to simulate the runs: processes (default), inline, dask (a cluster on this "
        "machine), or dask://HOST:PORT (an existing scheduler)",
    )
    parser.add_argument(
        "--workers",
        metavar="N",
        type=number_in(1, MAX_WORKERS, "a number of workers", of=int),
        help="worker processes (executors processes and dask; default: one per processor)",
    )
    parser.add_argument(
        "--estimate",
        action="store_true",
        help="only print the number of runs and their estimated cost",
    )
    parser.add_argument(
        "--force", action="store_true", help="replace the study or other files in --output"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    add_data_directory(parser)


def execute(arguments: argparse.Namespace) -> ExitStatus:
    """Executes the command."""
    with Progress("reading the study"):
        from slipgrasp.core.executors import make_executor
        from slipgrasp.core.study.loading import load_study

        study = load_study(arguments.study)
        executor = make_executor(arguments.executor, workers=arguments.workers)
    load_simulation(study.base)
    with executor:
        return _execute_with(arguments, study, executor)


def _execute_with(arguments: argparse.Namespace, study: Study, executor: Executor) -> ExitStatus:
    cost = _estimate(study, executor, is_remote=arguments.executor.startswith(REMOTE))
    if arguments.estimate:
        if study.num_runs <= CHECKED_BY_ESTIMATE:
            _check(study)
        _print_estimate(study, executor, cost, as_json=arguments.json)
        return ExitStatus.COMPLETED
    from slipgrasp.cli.study_folder import find_folder
    from slipgrasp.core.study.checks import find_warnings

    folder = find_folder(
        arguments.output,
        data_directory(arguments.data_directory),
        study,
        name=arguments.study.stem,
        force=arguments.force,
    )
    complain(_words(study, executor, cost))
    for warning in find_warnings(study):
        complain(f"mind: {warning}")
    _check(study)
    return _run(study, executor, folder, as_json=arguments.json)


def _estimate(study: Study, executor: Executor, *, is_remote: bool) -> StudyCost:
    from slipgrasp.core.study.cost import estimate_cost

    if is_remote:
        # Only the scheduler knows the number of workers.
        with Progress(f"connecting to {executor.name}"):
            executor.prepare()
    with Progress("timing some of its runs"):
        return estimate_cost(study, max(executor.num_workers, 1))


def _words(study: Study, executor: Executor, cost: StudyCost) -> str:
    from slipgrasp.cli.study_report import duration_words, size_words

    workers = f"{executor.num_workers} worker{'s' if executor.num_workers != 1 else ''}"
    kept = {"all": "every recording", "ended-early": "recordings of early ends", "none": "no run"}
    return (
        f"{cost.runs} run{'s' if cost.runs != 1 else ''}, about {duration_words(cost.seconds)} on "
        f"{workers} once started, "
        f"at most {size_words(cost.bytes)} with {kept[study.recordings]} kept"
    ).replace("with no run kept", "without recordings")


def _print_estimate(study: Study, executor: Executor, cost: StudyCost, *, as_json: bool) -> None:
    if as_json:
        document = {
            "runs": cost.runs,
            "seconds": cost.seconds,
            "bytes": cost.bytes,
            "workers": executor.num_workers,
        }
        print(json.dumps(document, allow_nan=False))
    else:
        print(_words(study, executor, cost))


def _check(study: Study) -> None:
    from slipgrasp.core.study.loading import check_members

    with Progress("checking the runs") as progress:
        check_members(study, progress.update)


def _run(study: Study, executor: Executor, folder: StudyFolder, *, as_json: bool) -> ExitStatus:
    from slipgrasp.recordings.exceptions import RecordingWriteError
    from slipgrasp.recordings.study.results import StudyResults

    results = StudyResults(study)
    started = time.monotonic()
    failure: RecordingWriteError | None = None
    end: StudyEnd | None = None
    try:
        end = _schedule(study, executor, folder, results)
    except RecordingWriteError as error:
        failure = error
    seconds = time.monotonic() - started
    completed = end is not None and end.state == "completed"
    with Progress("writing the table and the map"):
        # The map of an interrupted study is drawn when it is continued, not while the user waits.
        saved = folder.save_results(results, with_maps=completed)
    if failure is not None:
        complain(f"the study stopped: {failure}")
    if not completed:
        complain(
            f"{results.num_rows} of {study.num_runs} runs are done; repeat the command to continue"
        )
    if as_json:
        print(json.dumps(_document(results, saved, seconds, executor, end), allow_nan=False))
    else:
        from slipgrasp.cli.study_report import report

        print(report(results, seconds, saved, "" if end is None else end.message))
    return ExitStatus.COMPLETED if completed else ExitStatus.ENDED_EARLY


def _schedule(
    study: Study,
    executor: Executor,
    folder: StudyFolder,
    results: StudyResults,
) -> StudyEnd:
    from slipgrasp.cli.study_report import StudyProgress
    from slipgrasp.recordings.study.scheduler import schedule_runs

    with Interrupt() as interrupt, folder.writer(study) as writer:
        folder.read_rows(results, writer.num_rows)
        with Progress(f"starting the workers ({executor.name})"):
            executor.prepare(lambda: interrupt.requested)
        with Progress("simulating") as progress:
            shown = StudyProgress(progress, study.num_runs)
            end = schedule_runs(
                study,
                executor,
                writer,
                should_stop=lambda: interrupt.requested,
                watch=lambda row: shown.note(results, row),
                keep=folder.keep,
            )
        if end.state == "completed":
            writer.finish(end)
    return end


def _document(
    results: StudyResults,
    saved: dict[str, Any],
    seconds: float,
    executor: Executor,
    end: StudyEnd | None,
) -> dict[str, Any]:
    summary = results.summary()
    return {
        "runs": summary.finished,
        "planned": summary.runs,
        "state": "failed" if end is None else end.state,
        "outcomes": summary.outcomes,
        "held": summary.held,
        "unknowns": list(summary.unknowns),
        "told": summary.told,
        **saved,
        "seconds": seconds,
        "executor": executor.name,
        "message": "" if end is None else end.message,
    }
