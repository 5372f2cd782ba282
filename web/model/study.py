"""What a session shows of studies."""

from __future__ import annotations

from dataclasses import dataclass

from slipgrasp.server.studies.progress import StudyStatus
from slipgrasp.web.model.study_draft import Offer, StudyDraft
from slipgrasp.web.model.study_map import MapPicture


@dataclass(frozen=True, slots=True)
class Price:
    """What the planned study is going to take.

    Attributes:
        seconds: Computing time [s].
        warnings: What stands in the way of it.
    """

    seconds: float
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """The study on the screen.

    Attributes:
        status: How far it is.
        behind: How many others come first, where it waits.
        picture: Its map so far; None until there is one.
        has_map: Whether there can be one.
    """

    status: StudyStatus
    behind: int = 0
    picture: MapPicture | None = None
    has_map: bool = True

    @property
    def study_id(self) -> str:
        """Its name in the store."""
        return self.status.stored.id


@dataclass(frozen=True, slots=True)
class StudyRun:
    """A run of a study that the user has asked for.

    Attributes:
        study_id: The study.
        index: The run.
        run_id: Where its recording is kept; empty while it is being made, or cannot be.
        message: Why it cannot be shown, if so.
    """

    study_id: str
    index: int
    run_id: str = ""
    message: str = ""

    @property
    def is_awaited(self) -> bool:
        """Whether it is being made."""
        return not self.run_id and not self.message


@dataclass(frozen=True, slots=True, eq=False)
class StudyView:
    """What a session shows of studies.

    Attributes:
        offers: The parameters of the draft that may vary.
        draft: What the next study varies; None until the scenario is known.
        price: What it is going to take; None while that is not known.
        problems: Why it cannot run, a sentence each.
        is_starting: Whether it is being checked, and taken on.
        followed: The study on the screen.
        study_run: The run of it that was asked for last.
        listed: The newest studies of the store.
        is_draft_shown: Whether the panel shows the draft, rather than the map.
        is_draft_seen: Whether its tab is in front, so that the user sees the draft.
        is_wide: Whether the map is wider than other panels.
        message: Why a study could not be opened, if so.
    """

    offers: tuple[Offer, ...] = ()
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
        """What is offered under a key."""
        return next((offer for offer in self.offers if offer.key == key), None)
