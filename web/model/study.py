"""State of studies in a session."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.server.studies.progress import StudyStatus
from slipgrasp.web.model.study_draft import Offer, StudyDraft
from slipgrasp.web.model.study_map import MapPicture


@dataclass(frozen=True, slots=True)
class Price:
    """The estimated cost of the planned study.

    Attributes:
        seconds: Computing time [s].
        warnings: Possible obstacles.
    """

    seconds: float
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """The study on the screen.

    Attributes:
        status: Its progress.
        behind: Number of studies before it, if it waits.
        picture: Its current map; None if there is none yet.
        has_map: Whether it can have one.
    """

    status: StudyStatus
    behind: int = 0
    picture: MapPicture | None = None
    has_map: bool = True

    @property
    def study_id(self) -> str:
        """Its id."""
        return self.status.stored.id


@dataclass(frozen=True, slots=True)
class StudyRun:
    """A requested run of a study.

    Attributes:
        study_id: The study.
        index: The run.
        run_id: Id of its recording; empty while it is being created, or after a failure.
        message: Reason for a failure.
    """

    study_id: str
    index: int
    run_id: str = ""
    message: str = ""

    @property
    def is_awaited(self) -> bool:
        """Whether it is being created."""
        return not self.run_id and not self.message


@dataclass(frozen=True, slots=True, eq=False)
class StudyView:
    """State of studies in a session.

    Attributes:
        offers: The parameters of the draft that can vary.
        compared: The comparisons of settings that the scenario has.
        draft: Variations of the next study; None until the scenario is known.
        price: Its estimated cost; None while unknown.
        problems: Reasons why it cannot run, a sentence each.
        is_starting: Whether it is being checked and created.
        followed: The study on the screen.
        study_run: Its run that was requested last.
        listed: The newest studies of the store.
        is_draft_shown: Whether the panel shows the draft instead of the map.
        is_draft_seen: Whether its tab is visible.
        is_wide: Whether the map is wider than other panels.
        message: Reason why a study could not be opened; empty if none.
    """

    offers: tuple[Offer, ...] = ()
    compared: tuple[str, ...] = ()
    draft: StudyDraft | None = None
    price: Price | None = None
    problems: tuple[str, ...] = ()
    is_starting: bool = False
    followed: Followed | None = None
    study_run: StudyRun | None = None
    listed: tuple[StudyStatus, ...] = ()
    is_draft_shown: bool = True
    is_draft_seen: bool = False
    is_wide: bool = False
    message: str = ""

    def offer_of(self, key: str) -> Offer | None:
        """The parameter with a key."""
        return next((offer for offer in self.offers if offer.key == key), None)
