"""The map of a study as it stands in the page: drawn from rows, answering to clicks."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from html import unescape
from pathlib import Path

import pytest

from slipgrasp.core.study.definition import Study
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.web.charts.study_map import MOST_CELLS, draw_map
from slipgrasp.web.model.study_draft import study_of
from slipgrasp.web.model.study_map import MapPicture, locate
from slipgrasp.web.model.ticks import ticks_of
from slipgrasp.web.panels.map_html import map_html
from tests.recordings.studying import make_study, run_study
from tests.web.studying import STUDY_DRAFT, quick_scenario


@pytest.fixture(scope="module")
def study() -> Study:
    return study_of(STUDY_DRAFT, quick_scenario(), "quick")


@pytest.fixture(scope="module")
def results(study: Study, tmp_path_factory: pytest.TempPathFactory) -> StudyResults:
    return run_study(study, tmp_path_factory.mktemp("map") / "study.mcap")


def picture_of(results: StudyResults) -> MapPicture:
    picture = draw_map(results)
    assert picture is not None
    return picture


def opened_by(html: str) -> Iterator[int]:
    """The runs that clicks on the marks of a map open."""
    for attribute in re.findall(r'data-sg-intent="([^"]*)"', html):
        intent = json.loads(unescape(attribute))
        assert intent["kind"] == "open-study-run"
        yield intent["index"]


def test_every_run_is_a_cell_that_opens_it(results: StudyResults) -> None:
    html = map_html(picture_of(results), None)
    assert sorted(opened_by(html)) == list(range(9))


def test_a_cell_tells_values_outcome_and_slip_of_its_run(results: StudyResults) -> None:
    html = map_html(picture_of(results), None)
    row = results.row(7)
    title = next(t for t in re.findall("<title>(.*?)</title>", html) if t.startswith("run 7:"))
    assert "object mass 2.5 kg, friction of all fingers 0.3" in title
    slip = 1e3 * max(row["slip_path_0"], row["slip_path_1"])
    assert f"slip {slip:.3g} mm" in title


def test_runs_that_are_not_done_have_no_cell_yet(results: StudyResults) -> None:
    picture = picture_of(results.first(4))
    assert sorted(opened_by(map_html(picture, None))) == [0, 1, 2, 3]
    assert picture.finished == 4


def test_counts_of_the_key_are_those_of_the_results(results: StudyResults) -> None:
    picture = picture_of(results)
    summary = results.summary()
    assert picture.held == summary.held
    assert picture.finished == summary.finished == 9


def test_the_run_on_the_screen_is_framed_where_its_cell_is(results: StudyResults) -> None:
    picture = picture_of(results)
    place, box = locate(picture, 5) or pytest.fail("run 5 has no place")
    assert place == 0
    x, y = picture.across.share(1.5), picture.up.share(0.5)
    assert box.left < x < box.right
    assert box.low < y < box.high
    assert "sg-map-ring" not in map_html(picture, None)
    assert "sg-map-ring" in map_html(picture, 5)
    assert locate(picture, 9) is None


def test_what_is_compared_has_a_map_of_each(tmp_path: Path) -> None:
    vary = {
        "object.mass": {"min": 0.5, "max": 1.5, "count": 3},
        "fingers.*.friction": {"min": 0.1, "max": 0.5, "count": 3},
        "controller.lyapunov_weight": {"values": [1.0, 20.0]},
    }
    study = make_study(vary=vary, set={"simulation.duration": 0.1})
    picture = picture_of(run_study(study, tmp_path / "study.mcap"))
    assert [panel.title for panel in picture.panels] == [
        "Lyapunov weight Q = 1",
        "Lyapunov weight Q = 20",
    ]
    assert [sorted(opened_by(panel.marks)) for panel in picture.panels] == [
        list(range(0, 18, 2)),
        list(range(1, 18, 2)),
    ]
    assert (locate(picture, 7) or pytest.fail())[0] == 1


def test_samples_are_points(tmp_path: Path) -> None:
    study = make_study(
        vary={
            "object.mass": {"min": 0.5, "max": 2.0, "scale": "log"},
            "fingers.0.friction": {"min": 0.1, "max": 0.5},
        },
        sampling={"method": "random", "runs": 6},
        set={"simulation.duration": 0.1},
    )
    picture = picture_of(run_study(study, tmp_path / "study.mcap"))
    assert sorted(opened_by(picture.panels[0].marks)) == list(range(6))
    assert picture.panels[0].marks.count("<circle") == 6
    assert (locate(picture, 2) or pytest.fail())[1].left > 0.0


def test_a_large_grid_is_lumped_and_says_so(tmp_path: Path) -> None:
    study = make_study(
        vary={
            "object.mass": {"min": 0.5, "max": 2.0, "count": 120},
            "fingers.0.friction": {"min": 0.1, "max": 0.5, "count": 120},
        },
        set={"simulation.duration": 0.001},
    )
    results = run_study(study, tmp_path / "study.mcap", until=600)
    picture = picture_of(results)
    marks = list(opened_by(picture.panels[0].marks))
    assert picture.lumped == 3
    assert 0 < len(marks) <= MOST_CELLS
    assert picture.across.edges is not None and picture.up.edges is not None
    assert (len(picture.across.edges) - 1) * (len(picture.up.edges) - 1) <= MOST_CELLS
    assert "A cell represents 3 × 3 runs" in map_html(picture, None)


def test_a_study_over_one_parameter_has_no_map() -> None:
    study = make_study(vary={"object.mass": {"min": 0.5, "max": 2.0, "count": 3}})
    assert draw_map(StudyResults(study)) is None


def test_what_a_study_is_called_never_becomes_markup(tmp_path: Path) -> None:
    study = make_study(
        vary={
            "object.mass": {"values": [0.5, 0.6, 0.7]},
            "fingers.0.friction": {"values": [0.1, 0.2, 0.3]},
            "title": {"values": ["<img src=x>", "<b>"]},
        },
        set={"simulation.duration": 0.05},
    )
    html = map_html(picture_of(run_study(study, tmp_path / "study.mcap")), 0)
    assert "<img" not in html
    assert "&lt;img" in html


@pytest.mark.parametrize(
    ("low", "high", "is_log", "expected"),
    [
        (0.1, 3.1, False, [1.0, 2.0, 3.0]),
        (0.0, 1.0, False, [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]),
        (0.1, 30.0, True, [0.1, 0.3, 1.0, 3.0, 10.0, 30.0]),
        (0.5, 2.5, True, [0.5, 1.0, 2.0]),
        (1e-6, 1e3, True, None),
        (1.0, 1.0 + 1e-9, False, None),
    ],
)
def test_numbers_at_an_axis_are_few_and_round(
    low: float, high: float, is_log: bool, expected: list[float] | None
) -> None:
    ticks = ticks_of(low, high, is_log=is_log)
    assert 2 <= len(ticks) <= 10
    assert all(low * (1 - 1e-6) <= tick <= high * (1 + 1e-6) for tick in ticks)
    if expected is not None:
        assert ticks == pytest.approx(expected)
