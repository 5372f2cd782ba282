"""The reducer of studies: plans them, starts them, follows one, and opens its runs."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import count

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.server.budget import MemoryBudget
from slipgrasp.server.studies.service import StudyService
from slipgrasp.web.model.intents.intent import Intent, Send
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
    SizeMap,
    StartStudy,
    StudiesListed,
    StudyMoved,
    StudyPriced,
    StudyRefused,
    StudyRunRecorded,
    StudyRunRefused,
    StudyStarted,
    StudyUnreadable,
)
from slipgrasp.web.model.study import Followed, Price, StudyRun, StudyView
from slipgrasp.web.model.study_draft import (
    StudyDraft,
    comparisons_for,
    comparisons_in,
    fitted,
    offers_of,
)
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.workers.study_worker import StudyWorker

POLL_INTERVAL = 0.5
REST_BEFORE_PRICE = 1.0
"""Pause before the cost of a study is estimated, which simulates the base once [s].

The cost is estimated only while the tab is visible.
"""

DraftIntent = ChooseAxis | SetRange | ChooseComparison


class StudyReducer(Reducer):
    """Manages the draft of the next study, and the study on the screen.

    A study belongs to the server: it continues after its session ends.

    Args:
        service: Service of studies.
        memory: The memory budget.
        send: Accepts the answers of the worker, and requests recordings.
    """

    def __init__(self, service: StudyService, memory: MemoryBudget, send: Send) -> None:
        self._send = send
        self._worker = StudyWorker(service, memory, send)
        self.workers = (self._worker,)
        self._base: object = None
        self._planned: tuple[object, object] = (None, None)
        self._planned_at = math.inf
        self._numbers = count(1)
        self._pricing = self._starting = self._following = 0
        self._followed_id: str | None = None
        self._poll_at = 0.0

    def start(self, view: ViewState) -> ViewState:
        """Asks for the list of studies."""
        self._worker.list()
        return view

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Changes the study draft, starts the worker, or shows its answer."""
        match intent:
            case ChooseAxis() | SetRange() | ChooseComparison():
                study = _redrafted(view.study, intent)
            case StartStudy():
                study = self._start(view)
            case OpenStudy(study_id):
                study = self._follow(view.study, study_id)
            case OpenStudyRun(index):
                study = self._ask_for_run(view.study, index)
            case _:
                study = self._take_rest(intent, view.study)
        return view if study is view.study else replace(view, study=study)

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Updates the study draft for a new scenario, estimates its cost, and polls the study."""
        if self._followed_id is not None and now >= self._poll_at:
            self._poll_at = now + POLL_INTERVAL
            self._worker.poll(self._following, self._followed_id)
        view = self._in_step(view)
        planned = (view.study.draft, view.draft)
        if planned != self._planned:
            self._planned, self._planned_at = planned, now
            self._pricing = 0  # An answer about an older draft is ignored.
            return replace(view, study=replace(view.study, price=None, problems=()))
        if view.study.is_draft_seen and now - self._planned_at >= REST_BEFORE_PRICE:
            self._planned_at = math.inf
            return self._ask_for_price(view)
        return view

    def wait(self, now: float, view: ViewState) -> float | None:
        """Requests ticks while a study is followed, or waits for its cost."""
        waits = [self._poll_at - now] if self._followed_id is not None else []
        if view.study.is_draft_seen and math.isfinite(self._planned_at):
            waits.append(self._planned_at + REST_BEFORE_PRICE - now)
        return max(min(waits), 0.0) if waits else None

    def _in_step(self, view: ViewState) -> ViewState:
        """Adapts the study draft to another base scenario; none if no parameter can vary."""
        if view.draft.base is self._base:
            return view
        self._base = view.draft.base
        offers = offers_of(view.draft.base)
        if not offers:
            return replace(view, study=replace(view.study, offers=(), draft=None))
        compared = comparisons_in(view.draft.base)
        study_draft = fitted(view.study.draft, offers, compared)
        study = replace(view.study, offers=offers, compared=compared, draft=study_draft)
        return replace(view, study=study)

    def _ask_for_price(self, view: ViewState) -> ViewState:
        if view.study.draft is None:
            return view
        try:
            scenario = view.draft.scenario()
        except ScenarioError:
            return view  # The editor shows its errors.
        self._pricing = next(self._numbers)
        self._worker.price(self._pricing, view.study.draft, scenario, view.draft.origin)
        return view

    def _start(self, view: ViewState) -> StudyView:
        study = view.study
        if study.draft is None or study.is_starting:
            return study
        try:
            scenario = view.draft.scenario()
        except ScenarioError as error:
            return replace(study, problems=tuple(finding.message for finding in error.errors))
        self._starting = next(self._numbers)
        self._worker.start(self._starting, study.draft, scenario, view.draft.origin)
        return replace(study, is_starting=True, problems=())

    def _follow(self, study: StudyView, study_id: str) -> StudyView:
        """Switches to a study; the screen is unchanged until it is loaded."""
        self._following = next(self._numbers)
        self._followed_id, self._poll_at = study_id, 0.0
        return replace(study, message="")

    def _ask_for_run(self, study: StudyView, index: int) -> StudyView:
        followed = study.followed
        if followed is None or not 0 <= index < followed.status.finished:
            return study
        self._worker.record(followed.study_id, index)
        return replace(study, study_run=StudyRun(followed.study_id, index))

    def _take_rest(self, intent: Intent, study: StudyView) -> StudyView:
        match intent:
            case CancelStudy() if study.followed is not None:
                self._worker.cancel(self._following, study.followed.study_id)
            case ResumeStudy() if study.followed is not None:
                study_id = study.followed.study_id
                study = self._follow(study, study_id)
                self._worker.resume(self._following, study_id)
            case ListStudies():
                self._worker.list()
            case ShowStudyDraft(is_shown):
                return replace(study, is_draft_shown=is_shown or study.followed is None)
            case SeeStudyDraft(is_visible):
                return replace(study, is_draft_seen=is_visible)
            case SizeMap(is_wide):
                return replace(study, is_wide=is_wide)
            case StudiesListed(studies):
                return replace(study, listed=studies)
            case StudyPriced() | StudyRefused() | StudyStarted():
                is_awaited = intent.number in (self._pricing, self._starting)
                return self._planned_answer(intent, study) if is_awaited else study
            case StudyMoved() | StudyUnreadable():
                is_awaited = intent.number == self._following
                return self._followed_answer(intent, study) if is_awaited else study
            case StudyRunRecorded() | StudyRunRefused():
                return self._run_answer(intent, study)
        return study

    def _planned_answer(
        self, answer: StudyPriced | StudyRefused | StudyStarted, study: StudyView
    ) -> StudyView:
        match answer:
            case StudyPriced(_, seconds, warnings):
                return replace(study, price=Price(seconds, warnings))
            case StudyRefused(number, messages):
                is_starting = study.is_starting and number != self._starting
                return replace(study, problems=messages, is_starting=is_starting)
            case StudyStarted(_, status):
                study = self._follow(study, status.stored.id)
                return _on_map(replace(study, is_starting=False), Followed(status))

    def _followed_answer(self, answer: StudyMoved | StudyUnreadable, study: StudyView) -> StudyView:
        if isinstance(answer, StudyUnreadable):
            self._followed_id = None
            return replace(study, message=answer.message)
        if answer.status.state.has_ended:
            self._followed_id = None
            self._worker.list()
        known = study.followed
        is_same = known is not None and known.study_id == answer.status.stored.id
        picture = answer.picture or (known.picture if known is not None and is_same else None)
        followed = Followed(answer.status, answer.behind, picture, answer.has_map)
        return replace(study, followed=followed) if is_same else _on_map(study, followed)

    def _run_answer(
        self, answer: StudyRunRecorded | StudyRunRefused, study: StudyView
    ) -> StudyView:
        study_run = StudyRun(answer.study_id, answer.index)
        if study.study_run != study_run:
            return study  # Another one was requested since.
        if isinstance(answer, StudyRunRefused):
            return replace(study, study_run=replace(study_run, message=answer.message))
        self._send(OpenRecording(answer.run_id))
        return replace(study, study_run=replace(study_run, run_id=answer.run_id))


def _on_map(study: StudyView, followed: Followed) -> StudyView:
    """The map of another study, with a legible width."""
    return replace(study, followed=followed, study_run=None, is_draft_shown=False, is_wide=True)


def _redrafted(study: StudyView, intent: DraftIntent) -> StudyView:
    """The study draft after a change by the user; invalid choices are ignored."""
    study_draft = study.draft
    if study_draft is None:
        return study
    match intent:
        case ChooseAxis(place, key) if (offer := study.offer_of(key)) is not None:
            study_draft = study_draft.with_axis(place, offer.axis(study_draft.axes[place].count))
        case SetRange(place, axis) if axis.key == study_draft.axes[place].key:
            study_draft = study_draft.with_axis(place, axis)
        case ChooseComparison(name):
            study_draft = replace(study_draft, comparison=name)
    return replace(study, draft=_without_conflict(study_draft, study.compared))


def _without_conflict(study_draft: StudyDraft, compared: tuple[str, ...]) -> StudyDraft:
    known = comparisons_for(study_draft, compared)
    return (
        study_draft
        if study_draft.comparison in known
        else replace(study_draft, comparison=known[0])
    )
