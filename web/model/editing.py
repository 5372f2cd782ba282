"""How a control acts, from the play head on or on the whole run; and undo and redo of it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import NamedTuple

from slipgrasp.core.exceptions import FieldError
from slipgrasp.web.model.draft import Draft, Value, change_time

_REMEMBERED = 200
_SAME_GESTURE = 1.5


class Turn(NamedTuple):
    """What undo or redo leads to."""

    draft: Draft
    history: History


@dataclass(frozen=True, slots=True)
class History:
    """Drafts before and after the present one; the oldest are forgotten.

    Attributes:
        past: Earlier drafts, the latest last.
        future: Drafts that were taken back, the next one last.
    """

    past: tuple[Draft, ...] = ()
    future: tuple[Draft, ...] = ()

    def with_past(self, present: Draft) -> History:
        """The history once something new follows the present draft."""
        return History((*self.past, present)[-_REMEMBERED:])

    def undo(self, present: Draft) -> Turn | None:
        """One step back; None where there is none."""
        if not self.past:
            return None
        return Turn(self.past[-1], History(self.past[:-1], (*self.future, present)))

    def redo(self, present: Draft) -> Turn | None:
        """One step forth again; None where there is none."""
        if not self.future:
            return None
        return Turn(self.future[-1], History((*self.past, present), self.future[:-1]))


class Reach(StrEnum):
    """What a control acts on."""

    PLAY_HEAD = "at the play head"
    WHOLE_RUN = "on the whole run"


@dataclass(frozen=True, slots=True)
class Gesture:
    """A control that is being moved; all its values together are one step of undo.

    Attributes:
        key: The parameter.
        time: From when on it acts [s]: where the play head stood when it began.
        moved_at: When its last value came, on the monotonic clock [s].
    """

    key: str
    time: float
    moved_at: float

    def goes_on(self, key: str, now: float) -> bool:
        """Whether another value of a parameter still belongs to it."""
        return key == self.key and now - self.moved_at < _SAME_GESTURE


@dataclass(frozen=True, slots=True)
class LawNote:
    """What choosing a law set.

    Attributes:
        kind: The law.
        settings: What was set with it, in words; empty if nothing was.
        time: From when on it acts [s].
    """

    kind: str
    settings: str
    time: float


@dataclass(frozen=True, slots=True)
class Editing:
    """How the user edits.

    Attributes:
        reach: What a control acts on.
        history: What was asked for before.
        gesture: The control moved last, if nothing else happened since.
        ghost_due: Whether the run on the screen becomes the ghost of the next one.
        file_errors: What is wrong with the scenario file that was loaded last.
        law_note: What the last step set with a law, None if it chose none.
    """

    reach: Reach = Reach.PLAY_HEAD
    history: History = field(default_factory=History)
    gesture: Gesture | None = None
    ghost_due: bool = False
    file_errors: tuple[FieldError, ...] = ()
    law_note: LawNote | None = None

    def begin(self, present: Draft) -> Editing:
        """Once something new follows the present draft."""
        return Editing(self.reach, self.history.with_past(present), ghost_due=True)

    def move(self, present: Draft, key: str, play_head: float, now: float) -> Editing:
        """Once a control was moved.

        Args:
            present: What was asked for until then.
            key: The parameter of the control.
            play_head: Where the play head stands [s].
            now: The monotonic clock [s].
        """
        if self.gesture is not None and self.gesture.goes_on(key, now):
            return replace(self, gesture=replace(self.gesture, moved_at=now))
        return replace(self.begin(present), gesture=Gesture(key, change_time(play_head), now))

    def holds(self, key: str, now: float) -> bool:
        """Whether the user has a control in hand: the program must not move it then."""
        return self.gesture is not None and self.gesture.goes_on(key, now)

    def key_in_hand(self, now: float) -> str:
        """The key of the control that the user has in hand, empty if none."""
        gesture = self.gesture
        return gesture.key if gesture is not None and self.holds(gesture.key, now) else ""

    def apply(self, draft: Draft, value: Value) -> Draft:
        """The draft once the control in hand took a value."""
        assert self.gesture is not None
        if self.reach is Reach.WHOLE_RUN:
            return draft.edited(self.gesture.key, value)
        return draft.edited_from(self.gesture.time, self.gesture.key, value)
