"""Exit statuses and error messages of commands."""

from __future__ import annotations

import sys
from enum import IntEnum
from typing import TYPE_CHECKING

from slipgrasp.core.exceptions import SlipgraspError

if TYPE_CHECKING:
    from slipgrasp.core.trace.types import Outcome


class ExitStatus(IntEnum):
    """Exit statuses that scripts may rely on."""

    COMPLETED = 0
    DIFFERENT = 1
    BAD_INPUT = 2
    ENDED_BY_PHYSICS = 3
    ENDED_EARLY = 4

    @classmethod
    def of(cls, outcome: Outcome) -> ExitStatus:
        """The exit status of a run that could be saved."""
        if outcome.ended_by_physics:
            return cls.ENDED_BY_PHYSICS
        return cls.COMPLETED if outcome.value == "completed" else cls.ENDED_EARLY


class CommandError(SlipgraspError):
    """A command that cannot be executed."""


def complain(message: str) -> None:
    """Prints an error message on one line of standard error."""
    print("slipgrasp:", " ".join(message.split()), file=sys.stderr)
