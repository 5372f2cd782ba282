"""Base class of intents."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, dataclass_transform

from annotated_types import MaxLen

from slipgrasp.server.tokens import Right

Key = Annotated[str, MaxLen(100)]
"""The id of a stored run, or the key of a parameter."""


@dataclass_transform(frozen_default=True)
@dataclass(frozen=True)
class Intent:
    """A request to a session by the user or a worker; its subclasses are frozen dataclasses.

    Attributes:
        right: The right with which a page may post it, of each class itself: none unless given.
            Intents that change a scenario or a study, or start a simulation, need all rights; those
            that only show something need the right to read.
    """

    right = Right.NOTHING

    def __init_subclass__(cls, *, right: Right = Right.NOTHING) -> None:
        cls.right = right
        dataclass(frozen=True)(cls)

    @property
    def subject(self) -> object:
        """Subject of the intent: in a batch, only the latest intent about a subject counts.

        None if every intent counts.
        """
        return None


class LatestIntent(Intent):
    """An intent that supersedes earlier ones of its kind."""

    @property
    def subject(self) -> object:
        """Its kind."""
        return type(self)


class Close(Intent):
    """The viewer has disconnected."""


Send = Callable[[Intent], None]
"""Accepts an intent and returns immediately."""
