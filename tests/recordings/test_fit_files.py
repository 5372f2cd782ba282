"""Fits as files: rows of a study, the journal of a killed fit, and what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from slipgrasp.core.fit.fit import FitOptions
from slipgrasp.core.fit.problem import FitProblem
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.exceptions import RecordingBusyError, RecordingExistsError
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.fit.journal import FitStoppedError
from slipgrasp.recordings.fit.run_fit import read_observations, run_fit
from slipgrasp.recordings.study.rebuild import rebuild_run
from slipgrasp.recordings.study.results import read_results

NOISE = {"object_pose": 2e-4, "slip": 2e-4}
OPTIONS = FitOptions(starts=2, twins=1)


@pytest.fixture(scope="module")
def problem(kernel, tmp_path_factory):
    path = tmp_path_factory.mktemp("data") / "run.mcap"
    base = with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.2})
    write_recording(simulate(with_values(base, {"object.mass": 1.13})), path)
    data = read_observations(path, NOISE)
    noise = data.sigmas * np.random.default_rng(1).standard_normal(data.values.shape)
    return FitProblem.make(base, ["object.mass"], replace(data, values=data.values + noise))


@pytest.fixture(scope="module")
def done(problem, tmp_path_factory):
    path = tmp_path_factory.mktemp("fit") / "fit.mcap"
    return path, run_fit(problem, path, OPTIONS)


@pytest.fixture(scope="module")
def total(problem, tmp_path_factory):
    """Number of runs that the whole fit simulates, with its twins."""
    count = iter(range(10_000))
    path = tmp_path_factory.mktemp("total") / "fit.mcap"
    run_fit(problem, path, OPTIONS, should_stop=lambda: next(count) < 0)
    return next(count)


def test_every_run_of_a_fit_is_a_row_of_a_study_that_can_be_rebuilt(done, problem):
    path, report = done
    results = read_results(path)

    assert results.num_rows == report.evaluations == results.study.num_runs
    assert results.study.base == problem.scenario
    masses = results.numbers("object.mass")
    assert np.isclose(masses, report.best["object.mass"], rtol=1e-9).any()
    assert len(set(masses.tolist())) == results.num_rows
    rebuilt = rebuild_run(path, 3)
    assert rebuilt.scenario.object.mass == masses[3]


def test_the_report_lies_beside_the_study_and_the_journal_is_gone(done):
    path, report = done

    assert json.loads(path.with_suffix(".json").read_text()) == json.loads(
        json.dumps(report.to_mapping())
    )
    assert sorted(file.name for file in path.parent.iterdir()) == ["fit.json", "fit.mcap"]


@pytest.mark.parametrize(("share", "cut"), [(0.02, 7), (0.5, 0), (0.98, 7)])
def test_a_fit_that_was_stopped_continues_with_the_same_result(
    done, total, problem, tmp_path, share, cut
):
    path, runs = tmp_path / "fit.mcap", max(int(share * total), 1)
    count = iter(range(total))
    with pytest.raises(FitStoppedError):
        run_fit(problem, path, OPTIONS, should_stop=lambda: next(count) >= runs)
    journal = tmp_path / "fit.mcap.journal"
    if cut:
        # As a kill leaves it in the middle of a line.
        journal.write_bytes(journal.read_bytes()[:-cut])
    simulated = iter(range(10_000))
    report = run_fit(problem, path, OPTIONS, should_stop=lambda: next(simulated) < 0)

    first, whole = done
    assert report.to_mapping() == whole.to_mapping()
    assert path.read_bytes() == first.read_bytes()
    assert path.with_suffix(".json").read_bytes() == first.with_suffix(".json").read_bytes()
    # Only what was missing was simulated.
    assert next(simulated) == total - runs + bool(cut)


def test_a_kill_while_the_files_are_written_loses_nothing(done, problem, tmp_path, monkeypatch):
    path = tmp_path / "fit.mcap"

    def fail(*arguments, **options):
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr("slipgrasp.recordings.fit.run_fit.write_report", fail)
        with pytest.raises(KeyboardInterrupt):
            run_fit(problem, path, OPTIONS)
    assert path.exists()
    report = run_fit(problem, path, OPTIONS, should_stop=lambda: True)

    assert report.to_mapping() == done[1].to_mapping()


def test_files_in_the_way_and_journals_of_other_fits_are_replaced_only_on_request(
    done, problem, tmp_path
):
    with pytest.raises(RecordingExistsError):
        run_fit(problem, done[0], OPTIONS)
    path = tmp_path / "fit.mcap"
    count = iter(range(100))
    with pytest.raises(FitStoppedError):
        run_fit(problem, path, FitOptions(starts=3), should_stop=lambda: next(count) > 3)
    with pytest.raises(RecordingBusyError, match="belongs to another fit"):
        run_fit(problem, path, OPTIONS)
    report = run_fit(problem, path, OPTIONS, overwrite=True)

    assert report.to_mapping() == done[1].to_mapping()
