"""Intents about the scenario that is asked for."""

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
    """The user moved the control of a parameter; its value is not validated yet."""

    key: str
    value: Value

    @property
    def subject(self) -> object:
        """The parameter."""
        return self.key


@dataclass(frozen=True, slots=True)
class ChooseReach(LatestIntent):
    """The user chose whether controls act from the play head on or on the whole run."""

    reach: Reach


@dataclass(frozen=True, slots=True)
class RemoveChange(Intent):
    """The user takes back one timed change: that of a parameter at a time [s]."""

    time: float
    key: Key


@dataclass(frozen=True, slots=True)
class RemoveChanges(Intent):
    """The user takes back every timed change, push and low-friction patch."""


@dataclass(frozen=True, slots=True)
class AddDisturbance(Intent):
    """The user lets something happen to the object at the play head.

    Attributes:
        what: What happens.
        contact: Under which fingertip, where that matters; None is the one nearest to slip.
    """

    what: Literal[DisturbanceKind.PUSH, DisturbanceKind.LOW_FRICTION_PATCH, DisturbanceKind.POUR]
    contact: Annotated[int, Interval(ge=0, le=1000)] | None = None


@dataclass(frozen=True, slots=True)
class DragObject(LatestIntent):
    """The user drags the object with a force [N]: a push at the play head, until they let go."""

    force: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class LetGo(Intent):
    """The user lets go of the object: the push with this force [N] stays."""

    force: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class RemoveDisturbance(Intent):
    """The user takes back a push or a low-friction patch, by its place among them."""

    index: Annotated[int, Interval(ge=0, le=10**6)]


@dataclass(frozen=True, slots=True)
class ChoosePreset(Intent):
    """The user chose another scenario to start from."""

    name: str


@dataclass(frozen=True, slots=True)
class LoadScenario(Intent):
    """The user loads a scenario file; neither its name nor its content is validated yet."""

    name: str
    content: bytes


@dataclass(frozen=True, slots=True)
class ResetScenario(Intent):
    """The user wants the preset back as it comes."""


@dataclass(frozen=True, slots=True)
class TryOut(Intent):
    """The user wants to try what the card suggests: the words of one of its buttons."""

    words: Annotated[str, MaxLen(600)]


@dataclass(frozen=True, slots=True)
class ChooseLaw(LatestIntent):
    """The user wants another control law on the whole run."""

    law: Annotated[str, MaxLen(80)]


@dataclass(frozen=True, slots=True)
class Undo(Intent):
    """The user wants back what was asked for before."""


@dataclass(frozen=True, slots=True)
class Redo(Intent):
    """The user wants again what was taken back."""
