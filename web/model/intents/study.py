"""Intents about studies, and what their worker answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Interval

from slipgrasp.server.studies.progress import StudyStatus
from slipgrasp.web.model.intents.intent import Intent, LatestIntent
from slipgrasp.web.model.study_draft import AxisDraft
from slipgrasp.web.model.study_map import MapPicture


@dataclass(frozen=True, slots=True)
class ChooseAxis(Intent):
    """The user chose which parameter varies along an axis, 0 across and 1 up."""

    place: int
    key: str


@dataclass(frozen=True, slots=True)
class SetRange(Intent):
    """The user set how a parameter varies; nothing of it is validated yet."""

    place: int
    axis: AxisDraft

    @property
    def subject(self) -> object:
        """The axis, and what varies along it."""
        return type(self), self.place, self.axis.key


@dataclass(frozen=True, slots=True)
class ChooseComparison(LatestIntent):
    """The user chose what is compared, by its name."""

    name: str


@dataclass(frozen=True, slots=True)
class StartStudy(LatestIntent):
    """The user wants the planned study to run."""


@dataclass(frozen=True, slots=True)
class CancelStudy(LatestIntent):
    """The user wants the study on the screen to end; what is done stays."""


@dataclass(frozen=True, slots=True)
class ResumeStudy(LatestIntent):
    """The user wants the study on the screen, which has failed, to go on."""


@dataclass(frozen=True, slots=True)
class OpenStudy(LatestIntent):
    """The user wants to see a study of the store; its id is not validated yet."""

    study_id: str


@dataclass(frozen=True, slots=True)
class OpenStudyRun(LatestIntent):
    """The user wants to see one run of the study on the screen; the index is not validated."""

    index: Annotated[int, Interval(ge=0, le=10**9)]


@dataclass(frozen=True, slots=True)
class ShowStudyDraft(LatestIntent):
    """The user wants to plan a study, or to go back to the map."""

    is_shown: bool


@dataclass(frozen=True, slots=True)
class SeeStudyDraft(LatestIntent):
    """The draft has come into the user's sight, or is hidden behind another tab."""

    is_visible: bool


@dataclass(frozen=True, slots=True)
class SizeMap(LatestIntent):
    """The user wants the map wide or narrow."""

    is_wide: bool


@dataclass(frozen=True, slots=True)
class ListStudies(LatestIntent):
    """The user wants the list of studies anew."""


@dataclass(frozen=True, slots=True)
class StudyPriced(Intent):
    """What a planned study is going to take.

    Attributes:
        number: Which question it answers.
        seconds: Computing time [s].
        warnings: What stands in the way of it.
    """

    number: int
    seconds: float
    warnings: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class StudyRefused(Intent):
    """A planned study cannot run, with the reasons; ``number`` is that of the question."""

    number: int
    messages: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class StudyStarted(Intent):
    """A study was taken on; ``number`` is that of the request."""

    number: int
    status: StudyStatus


@dataclass(frozen=True, slots=True)
class StudyMoved(Intent):
    """How far a study is.

    Attributes:
        number: Which request to follow a study it answers.
        status: The study.
        behind: How many others come first.
        picture: Its map; None if the one that is shown is still good.
        has_map: Whether there can be a map of it.
    """

    number: int
    status: StudyStatus
    behind: int
    picture: MapPicture | None
    has_map: bool


@dataclass(frozen=True, slots=True)
class StudyUnreadable(Intent):
    """A study could not be opened, with the reason; ``number`` is that of the request."""

    number: int
    message: str


@dataclass(frozen=True, slots=True)
class StudiesListed(Intent):
    """The newest studies of the store."""

    studies: tuple[StudyStatus, ...]


@dataclass(frozen=True, slots=True)
class StudyRunRecorded(Intent):
    """A run of a study was simulated again, checked and kept."""

    study_id: str
    index: int
    run_id: str


@dataclass(frozen=True, slots=True)
class StudyRunRefused(Intent):
    """A run of a study cannot be shown, with the reason."""

    study_id: str
    index: int
    message: str
