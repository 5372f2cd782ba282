"""The study panel against a real GUI: what it shows, and what it asks for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.study.knowledge import describe_knowledge_in
from slipgrasp.recordings.study.study_store import StoredStudy
from slipgrasp.server.jobs.job import StudyState
from slipgrasp.server.studies.progress import StudyStatus
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.charts.study_map import draw_map
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.playback import WindowChoice
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.study import Followed, Price, StudyRun, StudyView
from slipgrasp.web.model.study_draft import comparisons_in, offers_of, study_of
from slipgrasp.web.model.study_map import MapPicture
from slipgrasp.web.model.study_words import (
    list_label,
    number_words,
    progress_words,
    share_words,
    time_words,
)
from slipgrasp.web.model.view import RunStage, RunStatus, Shown, ViewState
from slipgrasp.web.panels.study_inputs import run_of_places
from slipgrasp.web.panels.study_panel import StudyPanel, draft_html, summary_html
from tests.recordings.studying import make_study, run_study
from tests.web.studying import STUDY_DRAFT, quick_scenario

PLANNED = StudyView(
    offers=offers_of(quick_scenario()),
    compared=comparisons_in(quick_scenario()),
    draft=STUDY_DRAFT,
)
STORED = StoredStudy(
    id="aaaaaaaaaaaa",
    created="2026-11-21T10:05:00+00:00",
    title="Mass and friction",
    base_name="",
    keys=("object.mass", "fingers.*.friction"),
    num_runs=9,
    recordings="none",
)


@dataclass
class Bench:
    """A panel, what it asks for, and how wide it has been made."""

    panel: StudyPanel
    asked: list[Intent] = field(default_factory=list)
    widths: list[bool] = field(default_factory=list)

    def show(self, study: StudyView, shown: Shown | None = None) -> None:
        view = ViewState(
            draft=Draft.starting_from("quick", quick_scenario()),
            status=RunStatus(RunStage.PREVIEW),
            choice=WindowChoice.SLIP,
            shown=shown,
            study=study,
        )
        self.panel.update(view)


@pytest.fixture
def bench(viewer_server: ViewerServer) -> Iterator[Bench]:
    asked: list[Intent] = []
    widths: list[bool] = []
    bench = Bench(StudyPanel(viewer_server.gui, asked.append, widths.append), asked, widths)
    yield bench
    bench.panel.remove()


@pytest.fixture(scope="module")
def picture(tmp_path_factory: pytest.TempPathFactory) -> MapPicture:
    study = study_of(STUDY_DRAFT, quick_scenario(), "quick")
    picture = draw_map(run_study(study, tmp_path_factory.mktemp("panel") / "study.mcap"))
    assert picture is not None
    return picture


def status_of(state: StudyState, finished: int = 9, **told: float) -> StudyStatus:
    return StudyStatus(stored=STORED, state=state, finished=finished, outcomes={}, **told)


def on_map(picture: MapPicture | None, status: StudyStatus) -> StudyView:
    return replace(
        PLANNED, is_draft_shown=False, is_wide=True, followed=Followed(status, 0, picture)
    )


def test_what_was_unknown_stands_above_the_map(picture: MapPicture) -> None:
    status = status_of(StudyState.COMPLETED)
    html = summary_html(Followed(status, 0, picture))
    assert escape(describe_knowledge_in(picture.study)) in html
    blind = replace(picture.study, base=replace(picture.study.base, estimates=()))
    html = summary_html(Followed(status, 0, replace(picture, study=blind)))
    assert "given the true friction and mass at every instant" in html
    assert "This study compares no adaptation." in html


def test_without_settings_to_compare_the_plan_has_no_comparison(bench: Bench) -> None:
    bench.show(replace(PLANNED, compared=()))
    assert not bench.panel.draft.inputs.comparison.visible


def test_the_cost_and_what_stands_in_the_way_are_told_before_it_runs() -> None:
    assert "<b>9 runs</b>, about 4 s" in draft_html(replace(PLANNED, price=Price(4.2)))
    refused = draft_html(replace(PLANNED, problems=("object mass is <b>",)))
    assert "Not run" in refused
    assert "&lt;b&gt;" in refused
    assert "Little room." in draft_html(replace(PLANNED, price=Price(1.0, ("little room",))))


def test_the_map_takes_the_place_of_the_plan_and_more_room(
    bench: Bench, picture: MapPicture
) -> None:
    bench.show(PLANNED)
    bench.show(on_map(picture, status_of(StudyState.COMPLETED)))
    assert not bench.panel.draft.run.visible
    assert bench.panel.map.map.content.count("data-sg-intent") >= 9
    assert bench.panel.map.study_run.open.visible
    bench.show(replace(on_map(picture, status_of(StudyState.COMPLETED)), is_draft_shown=True))
    assert bench.widths == [False, True, False]
    assert bench.panel.draft.back.visible


def test_a_study_that_runs_has_a_bar_and_can_be_cancelled(bench: Bench) -> None:
    status = status_of(StudyState.RUNNING, 3, rate=50.0, time_left=12.0)
    bench.show(on_map(None, status))
    part = bench.panel.map
    assert (part.bar.visible, part.cancel.visible) == (True, True)
    assert part.bar.value == pytest.approx(100.0 / 3.0)
    assert "3 of 9 runs · 50 runs/s · about 12 s left" in part.summary.content
    assert not part.study_run.open.visible
    bench.show(on_map(None, status_of(StudyState.CANCELLED, 3)))
    assert (part.bar.visible, part.cancel.visible) == (False, False)


def test_only_a_study_that_has_failed_can_be_gone_on_with(bench: Bench) -> None:
    for state in StudyState:
        bench.show(on_map(None, status_of(state, 3)))
        assert bench.panel.map.resume.visible == (state is StudyState.FAILED)


def test_values_of_a_run_are_chosen_from_those_that_were_tried(
    bench: Bench, picture: MapPicture
) -> None:
    study = replace(
        on_map(picture, status_of(StudyState.COMPLETED)), study_run=StudyRun(STORED.id, 5)
    )
    bench.show(study)
    mass, friction = bench.panel.map.study_run.values[:2]
    assert (tuple(mass.options), mass.value) == (("0.5", "1.5", "2.5"), "1.5")
    assert (tuple(friction.options), friction.value) == (("0.1", "0.3", "0.5"), "0.5")
    assert bench.panel.map.study_run.number.value == 5
    assert run_of_places(picture.study, (1, 2)) == 5


def test_only_the_run_on_the_screen_is_ringed(
    bench: Bench, picture: MapPicture, case_1: RunResult
) -> None:
    opened = StudyRun(STORED.id, 5, run_id="bbbbbbbbbbbb")
    study = replace(on_map(picture, status_of(StudyState.COMPLETED)), study_run=opened)
    for run_id, rings in (("cccccccccccc", 0), ("bbbbbbbbbbbb", 1)):
        bench.show(study, Shown(1, case_1, 0.0, Replay("a run", "now", case_1, run_id)))
        assert bench.panel.map.map.content.count("sg-map-ring") == rings


def test_what_came_of_a_study_is_told_in_words(picture: MapPicture) -> None:
    followed = Followed(status_of(StudyState.COMPLETED), 0, picture)
    html = summary_html(followed, 4, "run 3 does not <come out>")
    assert f"Held {picture.held} of 9" in html
    assert "&lt;come out&gt;" in html
    assert "Simulating run 4 again" in html
    assert "no map" in summary_html(Followed(status_of(StudyState.COMPLETED), has_map=False))


def test_samples_are_chosen_by_their_number(bench: Bench, tmp_path: Path) -> None:
    study = make_study(
        vary={
            "object.mass": {"min": 0.5, "max": 2.0},
            "fingers.0.friction": {"min": 0.1, "max": 0.5},
        },
        sampling={"method": "random", "runs": 4},
        set={"simulation.duration": 0.05},
    )
    sampled = draw_map(run_study(study, tmp_path / "study.mcap"))
    bench.show(on_map(sampled, status_of(StudyState.COMPLETED)))
    study_run = bench.panel.map.study_run
    assert study_run.number.visible
    assert not any(widget.visible for widget in study_run.values)


def test_studies_are_listed_by_what_they_are_about(bench: Bench) -> None:
    listed = (status_of(StudyState.COMPLETED), status_of(StudyState.RUNNING, 3))
    bench.show(replace(PLANNED, listed=listed[:1]))
    known = bench.panel.known.choice
    assert known.options[1] == list_label(listed[0])
    assert known.options[1].startswith("Mass and friction · 9 runs · completed · 2026-11-21")
    long = replace(listed[0], stored=replace(STORED, title="x" * 300))
    assert len(list_label(long)) < 130


@pytest.mark.parametrize(
    ("state", "behind", "words"),
    [
        (StudyState.QUEUED, 0, "About to start."),
        (StudyState.QUEUED, 1, "Waiting behind 1 study."),
        (StudyState.QUEUED, 3, "Waiting behind 3 studies."),
        (StudyState.CANCELLED, 0, "Cancelled after 4 of 9 runs."),
        (StudyState.FAILED, 0, "Failed after 4 of 9 runs."),
    ],
)
def test_every_state_of_a_study_has_words(state: StudyState, behind: int, words: str) -> None:
    assert progress_words(status_of(state, 4), behind) == words


def test_numbers_read_as_a_person_says_them() -> None:
    assert [number_words(n, "run") for n in (1, 2)] == ["1 run", "2 runs"]
    assert [time_words(t) for t in (0.3, 12.4, 300.0, 9000.0)] == [
        "less than a second",
        "about 12 s",
        "about 5 min",
        "about 2.5 h",
    ]
    assert [share_words(n, 1000) for n in (0, 1, 590)] == ["0 %", "< 1 %", "59 %"]
    assert share_words(0, 0) == "–"
