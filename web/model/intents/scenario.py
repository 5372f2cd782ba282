"""Intents about the edited scenario."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Interval, MaxLen

from slipgrasp.server.tokens import Right
from slipgrasp.web.model.disturbances import DisturbanceKind
from slipgrasp.web.model.draft import Value
from slipgrasp.web.model.editing import Reach
from slipgrasp.web.model.intents.intent import Intent, Key, LatestIntent


class SetParameter(Intent):
    """A control was moved; its value is not validated yet."""

    key: str
    value: Value

    @property
    def subject(self) -> object:
        """The parameter."""
        return self.key


class ChooseReach(LatestIntent):
    """Selects whether controls act from the play head on or on the whole run."""

    reach: Reach


class RemoveChange(Intent, right=Right.EVERYTHING):
    """Removes a timed change: that of a parameter at a time [s]."""

    time: float
    key: Key


class RemoveChanges(Intent, right=Right.EVERYTHING):
    """Removes every timed change, push and low-friction patch."""


class AddDisturbance(Intent, right=Right.EVERYTHING):
    """Adds a disturbance at the play head.

    Attributes:
        what: Kind of disturbance.
        contact: Index of the fingertip, if it matters; None is the one closest to slip.
    """

    what: Literal[DisturbanceKind.PUSH, DisturbanceKind.LOW_FRICTION_PATCH, DisturbanceKind.POUR]
    contact: Annotated[int, Interval(ge=0, le=1000)] | None = None


class DragObject(LatestIntent):
    """The user drags the object with a force [N]: a push at the play head until release."""

    force: tuple[float, ...]


class LetGo(Intent):
    """The user releases the object: the push with this force [N] is kept."""

    force: tuple[float, ...]


class RemoveDisturbance(Intent, right=Right.EVERYTHING):
    """Removes a disturbance by its index."""

    index: Annotated[int, Interval(ge=0, le=10**6)]


class ChoosePreset(Intent):
    """Selects another scenario to start from."""

    name: str


class LoadScenario(Intent):
    """Loads a scenario file; neither its name nor its content is validated yet."""

    name: str
    content: bytes


class ResetScenario(Intent):
    """Restores the original preset."""


class TryOut(Intent, right=Right.EVERYTHING):
    """Applies a hint of the summary card, given by the label of its button."""

    words: Annotated[str, MaxLen(600)]


class ChooseLaw(LatestIntent, right=Right.EVERYTHING):
    """Selects a control law for the whole run."""

    law: Annotated[str, MaxLen(80)]


class Undo(Intent, right=Right.EVERYTHING):
    """Undoes the last change."""


class Redo(Intent, right=Right.EVERYTHING):
    """Redoes an undone change."""
