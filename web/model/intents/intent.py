"""Base class of intents."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

from annotated_types import MaxLen

Key = Annotated[str, MaxLen(100)]
"""The id of a stored run, or the key of a parameter."""


@dataclass(frozen=True, slots=True)
class Intent:
    """A request to a session by the user or a worker."""

    @property
    def subject(self) -> object:
        """Subject of the intent: in a batch, only the latest intent about a subject counts.

        None if every intent counts.
        """
        return None


@dataclass(frozen=True, slots=True)
class LatestIntent(Intent):
    """An intent that supersedes earlier ones of its kind."""

    @property
    def subject(self) -> object:
        """Its kind."""
        return type(self)


@dataclass(frozen=True, slots=True)
class Close(Intent):
    """The viewer has disconnected."""


Send = Callable[[Intent], None]
"""Accepts an intent and returns immediately."""
