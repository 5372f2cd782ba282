"""Intents about the edited scenario."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from annotated_types import Interval, MaxLen

from slipgrasp.web.model.disturbances import DisturbanceKind
from slipgrasp.web.model.draft import Value
from slipgrasp.web.model.editing import Reach
from slipgrasp.web.model.intents.intent import Intent, Key, LatestIntent


@dataclass(frozen=True, slots=True)
class SetParameter(Intent):
    """A control was moved; its value is not validated yet."""

    key: str
    value: Value

    @property
    def subject(self) -> object:
        """The parameter."""
        return self.key


@dataclass(frozen=True, slots=True)
class ChooseReach(LatestIntent):
    """Selects whether controls act from the play head on or on the whole run."""

    reach: Reach


@dataclass(frozen=True, slots=True)
class RemoveChange(Intent):
    """Removes a timed change: that of a parameter at a time [s]."""

    time: float
    key: Key


@dataclass(frozen=True, slots=True)
class RemoveChanges(Intent):
    """Removes every timed change, push and low-friction patch."""


@dataclass(frozen=True, slots=True)
class AddDisturbance(Intent):
    """Adds a disturbance at the play head.

    Attributes:
        what: Kind of disturbance.
        contact: Index of the fingertip, if it matters; None is the one closest to slip.
    """

    what: Literal[DisturbanceKind.PUSH, DisturbanceKind.LOW_FRICTION_PATCH, DisturbanceKind.POUR]
    contact: Annotated[int, Interval(ge=0, le=1000)] | None = None


@dataclass(frozen=True, slots=True)
class DragObject(LatestIntent):
    """The user drags the object with a force [N]: a push at the play head until release."""

    force: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class LetGo(Intent):
    """The user releases the object: the push with this force [N] is kept."""

    force: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class RemoveDisturbance(Intent):
    """Removes a disturbance by its index."""

    index: Annotated[int, Interval(ge=0, le=10**6)]


@dataclass(frozen=True, slots=True)
class ChoosePreset(Intent):
    """Selects another scenario to start from."""

    name: str


@dataclass(frozen=True, slots=True)
class LoadScenario(Intent):
    """Loads a scenario file; neither its name nor its content is validated yet."""

    name: str
    content: bytes


@dataclass(frozen=True, slots=True)
class ResetScenario(Intent):
    """Restores the original preset."""


@dataclass(frozen=True, slots=True)
class TryOut(Intent):
    """Applies a hint of the summary card, given by the label of its button."""

    words: Annotated[str, MaxLen(600)]


@dataclass(frozen=True, slots=True)
class ChooseLaw(LatestIntent):
    """Selects a control law for the whole run."""

    law: Annotated[str, MaxLen(80)]


@dataclass(frozen=True, slots=True)
class Undo(Intent):
    """Undoes the last change."""


@dataclass(frozen=True, slots=True)
class Redo(Intent):
    """Redoes an undone change."""
