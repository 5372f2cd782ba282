"""The reach of controls (from the play head on, or the whole run), and undo and redo."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import NamedTuple

from slipgrasp.core.exceptions import FieldError
from slipgrasp.web.model.draft import Draft, Value, change_time

_REMEMBERED = 200
_SAME_GESTURE = 1.5


class Turn(NamedTuple):
    """The result of undo or redo."""

    draft: Draft
    history: History


@dataclass(frozen=True, slots=True)
class History:
    """Drafts before and after the current one; the oldest are forgotten.

    Attributes:
        past: Earlier drafts, the latest last.
        future: Undone drafts, the next one last.
    """

    past: tuple[Draft, ...] = ()
    future: tuple[Draft, ...] = ()

    def with_past(self, present: Draft) -> History:
        """The history after a new draft follows the current one."""
        return History((*self.past, present)[-_REMEMBERED:])

    def undo(self, present: Draft) -> Turn | None:
        """One step back; None if there is none."""
        if not self.past:
            return None
        return Turn(self.past[-1], History(self.past[:-1], (*self.future, present)))

    def redo(self, present: Draft) -> Turn | None:
        """One step forward; None if there is none."""
        if not self.future:
            return None
        return Turn(self.future[-1], History((*self.past, present), self.future[:-1]))


class Reach(StrEnum):
    """The reach of a control."""

    PLAY_HEAD = "at the play head"
    WHOLE_RUN = "on the whole run"


@dataclass(frozen=True, slots=True)
class Gesture:
    """A moving control; all its values together are one undo step.

    Attributes:
        key: The parameter.
        time: Start of its effect [s]: the play head when the move began.
        moved_at: Time of its last value, by the monotonic clock [s].
    """

    key: str
    time: float
    moved_at: float

    def goes_on(self, key: str, now: float) -> bool:
        """Whether another value of a parameter belongs to the same move."""
        return key == self.key and now - self.moved_at < _SAME_GESTURE


@dataclass(frozen=True, slots=True)
class LawNote:
    """The settings of a chosen law.

    Attributes:
        kind: The law.
        settings: The settings in words; empty if there are none.
        time: Start of its effect [s].
    """

    kind: str
    settings: str
    time: float


@dataclass(frozen=True, slots=True)
class Editing:
    """The state of editing.

    Attributes:
        reach: The reach of controls.
        history: Earlier drafts.
        gesture: The control that was moved last, if nothing else happened since.
        ghost_due: Whether the run on the screen becomes the ghost of the next one.
        file_errors: Errors of the scenario file that was loaded last.
        law_note: The settings of the law chosen in the last step; None if no law was chosen.
    """

    reach: Reach = Reach.PLAY_HEAD
    history: History = field(default_factory=History)
    gesture: Gesture | None = None
    ghost_due: bool = False
    file_errors: tuple[FieldError, ...] = ()
    law_note: LawNote | None = None

    def begin(self, present: Draft) -> Editing:
        """The state after a new draft."""
        return Editing(self.reach, self.history.with_past(present), ghost_due=True)

    def move(self, present: Draft, key: str, play_head: float, now: float) -> Editing:
        """The state after a control was moved.

        Args:
            present: The draft until then.
            key: The parameter of the control.
            play_head: Time of the play head [s].
            now: The monotonic clock [s].
        """
        if self.gesture is not None and self.gesture.goes_on(key, now):
            return replace(self, gesture=replace(self.gesture, moved_at=now))
        return replace(self.begin(present), gesture=Gesture(key, change_time(play_head), now))

    def key_in_hand(self, now: float) -> str:
        """The key of the control that the user is moving, empty if there is none.

        The program must not move it then.
        """
        gesture = self.gesture
        return gesture.key if gesture is not None and gesture.goes_on(gesture.key, now) else ""

    def apply(self, draft: Draft, value: Value) -> Draft:
        """The draft after a value of the moving control."""
        assert self.gesture is not None
        if self.reach is Reach.WHOLE_RUN:
            return draft.edited(self.gesture.key, value)
        return draft.edited_from(self.gesture.time, self.gesture.key, value)
