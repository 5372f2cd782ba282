"""Measured data over a run: their signals alone, thinned, and the words of a fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from slipgrasp.core.fit.progress import FitProgress
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.recordings.fit.fit_store import StoredFit
from slipgrasp.recordings.fit.request import FitRequest
from slipgrasp.recordings.measured.overlay import MOST_SAMPLES, laid_over, thinned
from slipgrasp.recordings.measured.recording import (
    MeasuredColumn,
    MeasuredOutline,
    MeasuredRecording,
    Sampling,
)
from slipgrasp.server.fits.progress import FitStatus
from slipgrasp.server.jobs.job import StudyState
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.charts.charts import charts_of
from slipgrasp.web.charts.drawn import ChartedRun, drawn_charts
from slipgrasp.web.model.charts_view import PLAIN
from slipgrasp.web.model.fit import FitView, progress_words
from slipgrasp.web.model.fit_profiles import profiles_of
from slipgrasp.web.model.playback import TimeWindow
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.sampling import Sampler
from slipgrasp.web.model.view import Ghost, Shown
from slipgrasp.web.scene.scene import Scene
from tests.web.test_scene_nodes import node, sent_for_close_ups


def measured_slip(samples: int) -> MeasuredRecording:
    times = np.linspace(0.0, 0.1, samples)
    sampling = Sampling(
        samples=samples, start=0.0, end=0.1, period=0.01, even=True, num_gaps=0, gaps=()
    )
    columns = (
        MeasuredColumn(name="slip_1", unit="m", source="s"),
        MeasuredColumn(name="room_light", unit="1", source="l"),
    )
    outline = MeasuredOutline(title="hand", columns=columns, sampling=sampling)
    values = np.stack([np.sin(times), np.ones(samples)], 1)
    return MeasuredRecording(outline=outline, times=times, values=values)


def test_a_run_of_measured_data_has_their_signals_and_no_others(case_1: RunResult) -> None:
    measured = measured_slip(11)
    result = laid_over(case_1, measured)
    columns = {column.name: column for column in columns_of(result.trace)}

    np.testing.assert_array_equal(columns["slip_1"].values, np.sin(measured.times))
    np.testing.assert_array_equal(result.trace.times, measured.times)
    others = [c for c in columns.values() if c.name not in ("t", "slip_1") and not c.holds_phases]
    assert all(np.isnan(column.values).all() for column in others)
    assert result.phase_changes == () and (result.trace.phase == 0).all()
    assert any(charts_of(result).values())


def test_signals_that_were_not_measured_have_no_line(case_1: RunResult) -> None:
    ghost = ChartedRun.of(laid_over(case_1, measured_slip(11)))
    charts = drawn_charts(ChartedRun.of(case_1), ghost, TimeWindow(0.0, 0.1), PLAIN, "Contact")
    lines = {drawn.chart.key: drawn.ghost.chart.lines for drawn in charts if drawn.ghost}

    assert [len(lines[key]) for key in ("slip", "slip-velocity")] == [1, 0]


def measured_poses(names: tuple[str, ...]) -> MeasuredRecording:
    """An object that moves along x, measured without the hand."""
    measured = measured_slip(11)
    columns = tuple(MeasuredColumn(name=name, unit="", source=name) for name in names)
    values = np.zeros((11, len(names)))
    values[:, 0] = measured.times
    return replace(measured, outline=replace(measured.outline, columns=columns), values=values)


def ghost_of(run: RunResult, measured: MeasuredRecording) -> Ghost:
    result = laid_over(run, measured)
    return Ghost(Shown(-1, result, 0.0, Replay("data", "", result, measured=measured)), "data")


def test_a_complete_measured_pose_is_drawn_without_a_hand(
    viewer_server: ViewerServer, case_1: RunResult
) -> None:
    pale = ghost_of(case_1, measured_poses(("x", "y", "theta"))).drawn
    assert pale is not None
    scene = Scene(viewer_server)
    scene.show(case_1, pale)
    scene.update(Sampler(case_1.trace).at(0.05), Sampler(pale.trace).at(0.05))

    place = node(viewer_server, "/ghost/plane/edges").position
    np.testing.assert_allclose(place[:2], (0.05, 0.0), atol=1e-6)
    assert viewer_server.scene.get_handle_by_name("/ghost/tip0") is None
    assert "ghostSlip" not in sent_for_close_ups(viewer_server)[1]


def test_an_incomplete_measured_pose_is_not_drawn(case_1: RunResult) -> None:
    assert ghost_of(case_1, measured_poses(("x", "y"))).drawn is None


def test_long_measured_data_are_thinned_evenly() -> None:
    kept = thinned(measured_slip(2 * MOST_SAMPLES + 1))

    assert len(kept.times) == MOST_SAMPLES * 2 // 3 + 1
    assert np.ptp(np.diff(kept.times)) < 1e-12


def status(**progress: object) -> FitStatus:
    request = FitRequest(recording="a" * 12, scenario={}, free=("object.mass",), signals={})
    stored = StoredFit(id="b" * 12, created="", request=request)
    shown = FitProgress(**progress)
    return FitStatus(stored=stored, state=StudyState.RUNNING, progress=shown)


def test_a_fit_tells_its_stage_and_its_profiles_so_far() -> None:
    points = ((1.0, 5.0), (1.1, 0.0))
    now = status(
        stage="profiles",
        share=0.5,
        evaluations=40,
        best={"object.mass": 1.1},
        profiles={"object.mass": points},
        threshold=3.84,
    )

    assert progress_words(now) == "Fitting: profiles, 50%; 40 runs."
    (profile,) = profiles_of(FitView(status=now))
    assert (profile.points, profile.words) == (points, "so far 1.1")
    assert profiles_of(FitView(status=status(stage="searching"))) == []


@pytest.mark.parametrize(
    ("kind", "numbers", "words"),
    [
        ("bounded", (1.1, 1.0, 1.2), "bounded: 1.1 kg, 95 % interval 1 … 1.2 kg"),
        (
            "only above",
            (None, None, 1.2),
            "only above: at most 1.2 kg; not bounded below in the searched range 0.2 … 3 kg",
        ),
        ("flat", (None, None, None), "flat: not bounded in the searched range 0.2 … 3 kg"),
    ],
)
def test_a_complete_fit_has_its_estimates_in_words(
    kind: str, numbers: tuple[float | None, ...], words: str
) -> None:
    value, low, high = numbers
    found = {"value": value, "low": low, "high": high, "class": kind, "unit": "kg", "note": ""}
    found["limits"] = [0.2, 3.0]
    report = {"parameters": {"object.mass": {**found, "profile": [[1.1, 0.0]]}}, "threshold": 4.0}

    (profile,) = profiles_of(FitView(report=report))

    assert profile.key == "object.mass [kg]" and profile.words.startswith(words)
