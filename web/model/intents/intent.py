"""What every intent is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

from annotated_types import MaxLen

Key = Annotated[str, MaxLen(100)]
"""The id of a stored run, or the key of a parameter."""


@dataclass(frozen=True, slots=True)
class Intent:
    """Something that a user, or a worker on the user's behalf, asks of a session."""

    @property
    def subject(self) -> object:
        """What it is about: of one batch, only the latest intent about a subject counts.

        None where every intent counts.
        """
        return None


@dataclass(frozen=True, slots=True)
class LatestIntent(Intent):
    """An intent that makes earlier ones of its kind void."""

    @property
    def subject(self) -> object:
        """Its kind."""
        return type(self)


@dataclass(frozen=True, slots=True)
class Close(Intent):
    """The viewer is gone."""


Send = Callable[[Intent], None]
"""Takes an intent and returns at once."""
