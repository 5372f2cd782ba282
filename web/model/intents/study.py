"""Intents about studies, and the answers of their worker."""

from __future__ import annotations

from typing import Annotated

from annotated_types import Interval

from slipgrasp.server.studies.progress import StudyStatus
from slipgrasp.server.tokens import Right
from slipgrasp.web.model.intents.intent import Intent, LatestIntent
from slipgrasp.web.model.study_draft import AxisDraft
from slipgrasp.web.model.study_map import MapPicture


class ChooseAxis(Intent):
    """Selects the parameter of an axis, 0 horizontal and 1 vertical."""

    place: int
    key: str


class SetRange(Intent):
    """Sets the range of a parameter, which is not validated yet."""

    place: int
    axis: AxisDraft

    @property
    def subject(self) -> object:
        """The axis, and what varies along it."""
        return type(self), self.place, self.axis.key


class ChooseComparison(LatestIntent):
    """Selects a comparison by name."""

    name: str


class StartStudy(LatestIntent):
    """Starts the planned study."""


class CancelStudy(LatestIntent):
    """Cancels the study on the screen; finished runs are stored."""


class ResumeStudy(LatestIntent):
    """Continues the failed study on the screen."""


class OpenStudy(LatestIntent):
    """Opens a stored study; its id is not validated yet."""

    study_id: str


class OpenStudyRun(LatestIntent, right=Right.EVERYTHING):
    """Opens one run of the study on the screen; the index is not validated."""

    index: Annotated[int, Interval(ge=0, le=10**9)]


class ShowStudyDraft(LatestIntent):
    """Plans a study, or returns to the map."""

    is_shown: bool


class SeeStudyDraft(LatestIntent, right=Right.EVERYTHING):
    """The draft became visible, or was hidden behind another tab."""

    is_visible: bool


class SizeMap(LatestIntent):
    """Changes the width of the map."""

    is_wide: bool


class ListStudies(LatestIntent):
    """Updates the list of studies."""


class StudyPriced(Intent):
    """The estimated cost of a planned study.

    Attributes:
        number: Number of the request.
        seconds: Computing time [s].
        warnings: Possible obstacles.
    """

    number: int
    seconds: float
    warnings: tuple[str, ...]


class StudyRefused(Intent):
    """A planned study is invalid, with the reasons; ``number`` is that of the request."""

    number: int
    messages: tuple[str, ...]


class StudyStarted(Intent):
    """A study was accepted; ``number`` is that of the request."""

    number: int
    status: StudyStatus


class StudyMoved(Intent):
    """The progress of a study.

    Attributes:
        number: Number of the request to follow it.
        status: The study.
        behind: Number of studies before it.
        picture: Its map; None if the current one is up to date.
        has_map: Whether it can have a map.
    """

    number: int
    status: StudyStatus
    behind: int
    picture: MapPicture | None
    has_map: bool


class StudyUnreadable(Intent):
    """A study could not be opened, with the reason; ``number`` is that of the request."""

    number: int
    message: str


class StudiesListed(Intent):
    """The newest studies of the store."""

    studies: tuple[StudyStatus, ...]


class StudyRunRecorded(Intent):
    """A run of a study was simulated again, verified and stored."""

    study_id: str
    index: int
    run_id: str


class StudyRunRefused(Intent):
    """A run of a study cannot be shown, with the reason."""

    study_id: str
    index: int
    message: str
