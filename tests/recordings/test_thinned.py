"""Figures of long runs: drawn from few samples, of which none that shows something is missing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.figures.trends import DRAWN_SIGNALS, trends_of
from slipgrasp.recordings.compare import thinned
from slipgrasp.recordings.compare.comparison import compare
from slipgrasp.recordings.compare.thinned import read_thinned
from slipgrasp.recordings.file.size import read_size
from slipgrasp.recordings.file.writer import write_recording

Pair = tuple[RunResult, RunResult]

VALUES = {"simulation.duration": 3.0, "simulation.output_rate": 4000.0}


@pytest.fixture(scope="module", params=["paper-case-1", "spatial-box"])
def runs(request: pytest.FixtureRequest) -> Pair:
    """Two long runs, the second of another mass and shorter."""
    scenario = with_values(load_scenario(request.param), VALUES)
    other = {"object.mass": 1.02 * scenario.object.mass, "simulation.duration": 2.5}
    return simulate(scenario), simulate(with_values(scenario, other))


@pytest.fixture(scope="module")
def paths(runs: Pair, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("thinned")
    for name, run in zip("ab", runs, strict=True):
        write_recording(run, folder / f"{name}.mcap")
    return folder / "a.mcap", folder / "b.mcap"


def thin(paths: tuple[Path, Path]) -> Pair:
    return read_thinned(paths, (read_size(paths[0]), read_size(paths[1])), DRAWN_SIGNALS)


@pytest.fixture(scope="module")
def thinned_runs(paths: tuple[Path, Path]) -> Pair:
    return thin(paths)


def drawn(run: RunResult) -> dict[str, np.ndarray]:
    return {c.name: c.values for c in columns_of(run.trace) if c.signal in DRAWN_SIGNALS}


def test_extremes_ends_and_every_sample_of_a_slip_remain(runs, thinned_runs) -> None:
    for few, whole in zip(thinned_runs, runs, strict=True):
        assert len(few.trace) < len(whole.trace) / 2
        few_columns, columns = drawn(few), drawn(whole)
        assert few_columns.keys() == columns.keys()
        rows = np.isin(whole.trace.times, few.trace.times)
        for name, values in columns.items():
            found = few_columns[name]
            assert (found.min(), found.max()) == (values.min(), values.max()), name
            assert (found[0], found[-1]) == (values[0], values[-1]), name
            assert np.isin(found, values[rows]).all(), name
        slips = (whole.trace.phase != ContactPhase.STICK).any(axis=1)
        assert slips.sum() > 10
        assert np.isin(whole.trace.times[slips], few.trace.times).all()
        assert few.phase_changes == whole.phase_changes
        assert (few.outcome, few.metrics, few.scenario) == (
            whole.outcome,
            whole.metrics,
            whole.scenario,
        )


def test_the_largest_differences_are_those_of_the_whole_runs(runs, thinned_runs) -> None:
    whole, few = compare(*runs), compare(*thinned_runs, check_claims=False)
    assert few.phase_changes == whole.phase_changes
    names = drawn(runs[0]).keys() & few.signals.keys()
    assert len(names) > 10
    for name in names:
        found, expected = few.signals[name], whole.signals[name]
        assert (found.max, found.time_of_max) == (expected.max, expected.time_of_max), name
        assert found.tolerance == expected.tolerance


def test_a_run_that_never_stops_slipping_keeps_a_bounded_number_of_samples(
    paths, thinned_runs, monkeypatch
) -> None:
    monkeypatch.setattr(thinned, "MOST_OF_EVENTS", 10)
    monkeypatch.setattr(thinned, "NUM_BINS", 5)
    for few, more in zip(thin(paths), thinned_runs, strict=True):
        width = sum(len(drawn(more)) for _ in range(3))
        assert len(few.trace) <= 10 + 6 * (2 + 2 * width)
        assert len(few.trace) < len(more.trace)


def test_the_thinned_signals_are_those_that_are_drawn(runs) -> None:
    signals = {column.name: column.signal for column in columns_of(runs[0].trace)}
    lines = [line for trend in trends_of(*runs) for line in trend.lines]
    assert {signals[line.column] for line in lines} <= DRAWN_SIGNALS
