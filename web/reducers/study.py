"""The reducer of studies: plans them, starts them, follows one, and opens its runs."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import count
from typing import ClassVar

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.server.studies.study_service import StudyService
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.intents.recordings import OpenRecording
from slipgrasp.web.model.intents.study import (
    CancelStudy,
    ChooseComparison,
    ChooseVaried,
    ListStudies,
    MemberRecorded,
    MemberRefused,
    OpenMember,
    OpenStudy,
    SeePlan,
    SetRange,
    ShowPlan,
    SizeMap,
    StartStudy,
    StudiesListed,
    StudyMoved,
    StudyPriced,
    StudyRefused,
    StudyStarted,
    StudyUnreadable,
)
from slipgrasp.web.model.study import Followed, Member, Price, StudyView
from slipgrasp.web.model.study_plan import Plan, comparisons_for, fitted, offers_of
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.workers.study_worker import StudyClerk

POLL_INTERVAL = 0.5
REST_BEFORE_PRICE = 1.0
"""How long plan and draft rest before the study is priced, which simulates the base once [s].

Whoever does not look at the plan need not know its price.
"""

PlanIntent = ChooseVaried | SetRange | ChooseComparison


class StudyReducer(Reducer):
    """Keeps the plan of the next study, and the study that is on the screen.

    A study belongs to the server: it goes on when its session ends.

    Args:
        service: Runs studies.
        send: Takes the answers of the clerk, and asks for recordings to be opened.
    """

    takes: ClassVar[tuple[type[Intent], ...]] = (
        ChooseVaried,
        SetRange,
        ChooseComparison,
        StartStudy,
        CancelStudy,
        OpenStudy,
        OpenMember,
        SeePlan,
        ShowPlan,
        SizeMap,
        ListStudies,
        StudyPriced,
        StudyRefused,
        StudyStarted,
        StudyMoved,
        StudyUnreadable,
        StudiesListed,
        MemberRecorded,
        MemberRefused,
    )

    def __init__(self, service: StudyService, send: Send) -> None:
        self._send = send
        self._clerk = StudyClerk(service, send)
        self.workers = (self._clerk.errands,)
        self._base: object = None
        self._planned: tuple[object, object] = (None, None)
        self._planned_at = math.inf
        self._numbers = count(1)
        self._pricing = self._starting = self._following = 0
        self._followed_id: str | None = None
        self._poll_at = 0.0

    def start(self, view: ViewState) -> ViewState:
        """Asks for the list of studies."""
        self._clerk.list()
        return view

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Changes the plan, asks the clerk, or shows what it answers."""
        match intent:
            case ChooseVaried() | SetRange() | ChooseComparison():
                study = _replanned(view.study, intent)
            case StartStudy():
                study = self._start(view)
            case OpenStudy(study_id):
                study = self._follow(view.study, study_id)
            case OpenMember(index):
                study = self._ask_for_member(view.study, index)
            case _:
                study = self._take_rest(intent, view.study)
        return view if study is view.study else replace(view, study=study)

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Keeps the plan in step with the draft, prices it, and looks after the study."""
        if self._followed_id is not None and now >= self._poll_at:
            self._poll_at = now + POLL_INTERVAL
            self._clerk.poll(self._following, self._followed_id)
        view = self._in_step(view)
        planned = (view.study.plan, view.draft)
        if planned != self._planned:
            self._planned, self._planned_at = planned, now
            self._pricing = 0  # An answer about what was planned before comes too late.
            return replace(view, study=replace(view.study, price=None, problems=()))
        if view.study.is_plan_seen and now - self._planned_at >= REST_BEFORE_PRICE:
            self._planned_at = math.inf
            return self._ask_for_price(view)
        return view

    def wait(self, now: float, view: ViewState) -> float | None:
        """Comes back while a study is followed, or is to be priced."""
        waits = [self._poll_at - now] if self._followed_id is not None else []
        if view.study.is_plan_seen and math.isfinite(self._planned_at):
            waits.append(self._planned_at + REST_BEFORE_PRICE - now)
        return max(min(waits), 0.0) if waits else None

    def _in_step(self, view: ViewState) -> ViewState:
        """Another scenario offers other parameters."""
        if view.draft.base is self._base:
            return view
        self._base = view.draft.base
        offers = offers_of(view.draft.base)
        plan = fitted(view.study.plan, offers)
        return replace(view, study=replace(view.study, offers=offers, plan=plan))

    def _ask_for_price(self, view: ViewState) -> ViewState:
        if view.study.plan is None:
            return view
        try:
            scenario = view.draft.scenario()
        except ScenarioError:
            return view  # The editor says what is wrong with it.
        self._pricing = next(self._numbers)
        self._clerk.price(self._pricing, view.study.plan, scenario, view.draft.origin)
        return view

    def _start(self, view: ViewState) -> StudyView:
        study = view.study
        if study.plan is None or study.is_starting:
            return study
        try:
            scenario = view.draft.scenario()
        except ScenarioError as error:
            return replace(study, problems=tuple(finding.message for finding in error.errors))
        self._starting = next(self._numbers)
        self._clerk.start(self._starting, study.plan, scenario, view.draft.origin)
        return replace(study, is_starting=True, problems=())

    def _follow(self, study: StudyView, study_id: str) -> StudyView:
        """Turns to a study; what is on the screen stays until it is there."""
        self._following = next(self._numbers)
        self._followed_id, self._poll_at = study_id, 0.0
        return replace(study, message="")

    def _ask_for_member(self, study: StudyView, index: int) -> StudyView:
        followed = study.followed
        if followed is None or not 0 <= index < followed.status.finished:
            return study
        self._clerk.record(followed.study_id, index)
        return replace(study, member=Member(followed.study_id, index))

    def _take_rest(self, intent: Intent, study: StudyView) -> StudyView:
        match intent:
            case CancelStudy() if study.followed is not None:
                self._clerk.cancel(self._following, study.followed.study_id)
            case ListStudies():
                self._clerk.list()
            case ShowPlan(is_shown):
                return replace(study, is_planning=is_shown or study.followed is None)
            case SeePlan(is_visible):
                return replace(study, is_plan_seen=is_visible)
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
            case MemberRecorded() | MemberRefused():
                return self._member_answer(intent, study)
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
            self._clerk.list()
        known = study.followed
        is_same = known is not None and known.study_id == answer.status.stored.id
        picture = answer.picture or (known.picture if known is not None and is_same else None)
        followed = Followed(answer.status, answer.behind, picture, answer.has_map)
        return replace(study, followed=followed) if is_same else _on_map(study, followed)

    def _member_answer(self, answer: MemberRecorded | MemberRefused, study: StudyView) -> StudyView:
        member = Member(answer.study_id, answer.index)
        if study.member != member:
            return study  # Another one was asked for since.
        if isinstance(answer, MemberRefused):
            return replace(study, member=replace(member, message=answer.message))
        self._send(OpenRecording(answer.run_id))
        return replace(study, member=replace(member, run_id=answer.run_id))


def _on_map(study: StudyView, followed: Followed) -> StudyView:
    """The map of another study, with room to read it."""
    return replace(study, followed=followed, member=None, is_planning=False, is_wide=True)


def _replanned(study: StudyView, intent: PlanIntent) -> StudyView:
    """The plan with what the user has changed; what is not offered changes nothing."""
    plan = study.plan
    if plan is None:
        return study
    match intent:
        case ChooseVaried(place, key) if (offer := study.offer_of(key)) is not None:
            plan = plan.with_axis(place, offer.axis(plan.axes[place].count))
        case SetRange(place, axis) if axis.key == plan.axes[place].key:
            plan = plan.with_axis(place, axis)
        case ChooseComparison(name):
            plan = replace(plan, comparison=name)
    return replace(study, plan=_without_conflict(plan))


def _without_conflict(plan: Plan) -> Plan:
    known = comparisons_for(plan)
    return plan if plan.comparison in known else replace(plan, comparison=known[0])
