"""Studies as a session sees them: planned, priced, run, followed, and opened run by run."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.study.definition import Study
from slipgrasp.recordings.exceptions import RecordingWriteError
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.recordings.study.study_store import StudyStore
from slipgrasp.recordings.study.writer import StudyWriter
from slipgrasp.server.budget import DEFAULT_BYTES, MemoryBudget
from slipgrasp.server.jobs.job import StudyState
from slipgrasp.server.studies.service import StudyService
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.recordings import OpenRecording
from slipgrasp.web.model.intents.study import (
    CancelStudy,
    ChooseAxis,
    ChooseComparison,
    ListStudies,
    OpenStudy,
    OpenStudyRun,
    ResumeStudy,
    SeeStudyDraft,
    SetRange,
    ShowStudyDraft,
    StartStudy,
    StudiesListed,
)
from slipgrasp.web.model.playback import WindowChoice
from slipgrasp.web.model.study import Followed, StudyView
from slipgrasp.web.model.study_draft import COMPARISONS, NO_COMPARISON, AxisDraft, study_of
from slipgrasp.web.model.study_words import progress_words
from slipgrasp.web.model.view import RunStage, RunStatus, ViewState
from slipgrasp.web.reducers.study import StudyReducer
from slipgrasp.web.workers.worker import QueueWorker
from tests.server.serving import patient_settings
from tests.waiting import PATIENCE, wait_until
from tests.web.studying import STUDY_DRAFT, quick_scenario

WEIGHT = "controller.lyapunov_weight"


@dataclass
class Bench:
    """A reducer of studies, and what is on the screen of its session."""

    reducer: StudyReducer
    service: StudyService
    answers: queue.SimpleQueue[Intent]
    view: ViewState

    @property
    def study(self) -> StudyView:
        return self.view.study

    @property
    def followed(self) -> Followed:
        assert self.study.followed is not None
        return self.study.followed

    def do(self, *intents: Intent) -> StudyView:
        for intent in intents:
            self.view = self.reducer.reduce(intent, self.view)
        self.view = self.reducer.pass_time(time.monotonic(), self.view)
        return self.study

    def until(self, holds: Callable[[StudyView], object]) -> StudyView:
        """Lives like a session until something is true of what it shows of studies."""
        patience = time.monotonic() + PATIENCE
        while not holds(self.study):
            now = time.monotonic()
            assert now < patience, self.study
            wait = self.reducer.wait(now, self.view)
            try:
                self.do(self.answers.get(timeout=0.2 if wait is None else wait))
            except queue.Empty:
                self.do()
        return self.study

    def plan(self, draft: Draft) -> None:
        """Plans the nine quick runs."""
        self.view = replace(self.view, draft=draft)
        self.do(*(SetRange(place, axis) for place, axis in enumerate(STUDY_DRAFT.axes)))

    def finish(self) -> None:
        """Runs them to their end."""
        self.do(StartStudy())
        self.until(lambda study: study.followed and study.followed.status.state.has_ended)
        self.until(lambda study: study.followed and study.followed.picture)


@pytest.fixture
def service(tmp_path: Path) -> Iterator[StudyService]:
    settings = patient_settings(tmp_path, study_executor="inline")
    store = RecordingStore(tmp_path)
    service = StudyService(StudyStore(tmp_path, store), settings)
    service.start()
    yield service
    service.close()
    store.close()


def new_bench(service: StudyService) -> Bench:
    answers: queue.SimpleQueue[Intent] = queue.SimpleQueue()
    reducer = StudyReducer(service, MemoryBudget(DEFAULT_BYTES), answers.put)
    view = ViewState(
        draft=Draft.starting_from("quick", quick_scenario()),
        status=RunStatus(RunStage.PREVIEW),
        choice=WindowChoice.SLIP,
    )
    bench = Bench(reducer, service, answers, reducer.start(view))
    bench.do()
    bench.plan(view.draft)
    return bench


def leave(bench: Bench) -> None:
    for worker in bench.reducer.workers:
        worker.close()
        worker.join(30.0)


@pytest.fixture
def bench(service: StudyService) -> Iterator[Bench]:
    bench = new_bench(service)
    yield bench
    leave(bench)
    assert "study-worker" not in {thread.name for thread in threading.enumerate()}


def test_what_a_browser_makes_up_changes_nothing(bench: Bench) -> None:
    before = bench.study.draft
    bench.do(ChooseAxis(0, "no.such"), SetRange(0, AxisDraft("no.such", 0.0, 1.0)))
    bench.do(ChooseComparison("no such"), OpenStudyRun(3))
    assert bench.study.draft == before
    assert bench.study.study_run is None


def test_a_plan_that_nobody_sees_is_not_priced(bench: Bench) -> None:
    for is_visible in (None, True, False):
        if is_visible is not None:
            bench.do(SeeStudyDraft(is_visible))
        later = time.monotonic() + 60.0
        is_wanted = bench.reducer.wait(later, bench.view) is not None
        assert is_wanted == bool(is_visible)
    bench.view = bench.reducer.pass_time(later, bench.view)
    done = threading.Event()
    (worker,) = bench.reducer.workers
    assert isinstance(worker, QueueWorker)
    worker.ask(done.set)
    assert done.wait(PATIENCE)
    asked = [bench.answers.get() for _ in range(bench.answers.qsize())]
    assert [type(intent) for intent in asked] == [StudiesListed]


def test_a_plan_that_is_seen_and_rests_is_priced_and_one_that_changes_no_longer(
    bench: Bench,
) -> None:
    bench.do(SeeStudyDraft(True))
    study = bench.until(lambda study: study.price)
    assert study.price is not None
    assert study.price.seconds > 0.0
    assert bench.do(ChooseComparison(next(iter(COMPARISONS)))).price is None


def test_an_axis_takes_away_the_comparison_of_what_it_varies(bench: Bench) -> None:
    name = next(name for name, (key, _) in COMPARISONS.items() if key == WEIGHT)
    study = bench.do(ChooseComparison(name), ChooseAxis(0, WEIGHT))
    assert study.draft is not None
    assert study.draft.comparison == NO_COMPARISON


def test_a_range_that_is_not_allowed_is_told_and_nothing_runs(bench: Bench) -> None:
    bench.do(SetRange(0, AxisDraft("object.mass", 0.0, 2.0, 3)), StartStudy())
    study = bench.until(lambda study: study.problems)
    assert "object mass, from is 0" in study.problems[0]
    assert study.followed is None
    assert not study.is_starting
    assert bench.service.list(0, 10)[1] == 0


def test_a_study_runs_to_its_map_and_stays_in_the_store(bench: Bench) -> None:
    bench.finish()
    picture = bench.followed.picture
    assert picture is not None
    assert bench.followed.status.state is StudyState.COMPLETED
    assert not bench.study.is_draft_shown
    bench.until(lambda _: bench.followed.picture and bench.followed.picture.finished == 9)
    study = bench.until(lambda study: study.listed)
    assert study.listed[0].stored.id == bench.followed.study_id
    assert progress_words(bench.followed.status, 0) == "Completed: 9 runs."
    assert bench.service.results(bench.followed.study_id).num_rows == 9


def test_a_run_of_it_is_simulated_again_and_opened(bench: Bench) -> None:
    bench.finish()
    bench.do(OpenStudyRun(7))
    assert bench.study.study_run is not None
    assert bench.study.study_run.is_awaited
    bench.until(lambda study: study.study_run and study.study_run.run_id)
    opened = bench.study.study_run
    assert opened is not None
    assert bench.answers.get(timeout=PATIENCE) == OpenRecording(opened.run_id)
    stored, is_new = bench.service.record_run(bench.followed.study_id, 7)
    assert (stored.id, is_new) == (opened.run_id, False)
    assert bench.do(OpenStudyRun(9)).study_run == opened


def test_a_run_that_does_not_come_out_again_is_told_so(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench.finish()
    heavier = replace(
        bench.service.results(bench.followed.study_id).study, base=load_scenario("paper-case-1")
    )
    results = bench.service.results(bench.followed.study_id)
    monkeypatch.setattr(results, "study", heavier)
    bench.do(OpenStudyRun(2))
    study = bench.until(lambda study: study.study_run and study.study_run.message)
    assert study.study_run is not None
    assert "differs from its result" in study.study_run.message
    assert not study.study_run.run_id


def long_study() -> Study:
    return study_of(STUDY_DRAFT, quick_scenario(200.0), "long")


def test_a_study_waits_behind_another_and_is_cancelled(bench: Bench) -> None:
    before = bench.service.create(long_study)
    bench.do(StartStudy())
    bench.until(lambda study: study.followed and study.followed.behind)
    assert progress_words(bench.followed.status, bench.followed.behind) == "Waiting behind 1 study."
    bench.do(CancelStudy())
    bench.until(lambda _: bench.followed.status.state is StudyState.CANCELLED)
    bench.service.cancel(before.stored.id)


def test_a_study_that_has_failed_is_resumed_and_followed_to_its_end(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise RecordingWriteError(Path("study.mcap"), "No space left on device")

    with monkeypatch.context() as disk:
        disk.setattr(StudyWriter, "add", fail)
        bench.do(StartStudy())
        bench.until(lambda study: study.followed and study.followed.status.state.has_ended)
    assert bench.followed.status.state is StudyState.FAILED
    bench.do(ResumeStudy())
    bench.until(lambda _: bench.followed.status.state is StudyState.COMPLETED)
    assert bench.followed.status.finished == bench.followed.status.stored.num_runs


def test_what_cannot_be_resumed_is_said(bench: Bench) -> None:
    bench.finish()
    bench.do(ResumeStudy())
    study = bench.until(lambda study: study.message)
    assert "is completed and cannot be resumed" in study.message


def test_a_study_goes_on_when_its_session_has_gone(service: StudyService) -> None:
    bench = new_bench(service)
    bench.do(StartStudy())
    bench.until(lambda study: study.followed)
    leave(bench)
    study_id = bench.followed.study_id
    wait_until(lambda: service.status(study_id).state.has_ended)
    assert service.status(study_id).state is StudyState.COMPLETED


def test_studies_of_others_are_listed_and_opened(bench: Bench) -> None:
    other = bench.service.create(lambda: study_of(STUDY_DRAFT, quick_scenario(), "another"))
    bench.do(ListStudies())
    bench.until(lambda study: [s.stored.id for s in study.listed] == [other.stored.id])
    bench.do(OpenStudy(other.stored.id))
    bench.until(lambda study: study.followed and study.followed.picture)
    assert bench.followed.status.stored.title.startswith("another")
    assert not bench.study.is_draft_shown
    assert bench.do(ShowStudyDraft(True)).is_draft_shown


@pytest.mark.parametrize("hostile", ["abcdefghijkl", "../../etc/passwd", "", "x" * 500])
def test_a_study_that_is_not_there_is_told_in_a_sentence(bench: Bench, hostile: str) -> None:
    bench.do(OpenStudy(hostile))
    study = bench.until(lambda study: study.message)
    assert "there is no study" in study.message
    assert study.is_draft_shown
