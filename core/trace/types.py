"""Small types shared by the simulator and the code that shows its results."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum, StrEnum

from slipgrasp.core.scenario.space import Space


class ContactPhase(IntEnum):
    """Phase of a contact; for planar hands gamma of Eq. 6, the sign of the slip velocity.

    For spatial hands, a contact on the cone slips in some direction, ``SLIP``; in the pyramid it
    has a gamma along each tangent, and its phase is 7 + 3 gamma_x + gamma_y unless both are 0.
    """

    SLIP_BACKWARD = -1
    STICK = 0
    SLIP_FORWARD = 1
    SLIP = 2
    SLIP_X_BACKWARD_Y_BACKWARD = 3
    SLIP_X_BACKWARD = 4
    SLIP_X_BACKWARD_Y_FORWARD = 5
    SLIP_Y_BACKWARD = 6
    SLIP_Y_FORWARD = 8
    SLIP_X_FORWARD_Y_BACKWARD = 9
    SLIP_X_FORWARD = 10
    SLIP_X_FORWARD_Y_FORWARD = 11

    @property
    def label(self) -> str:
        """The name in files: ``stick``, ``slip_forward``, or ``slip`` for spatial hands."""
        return self.name.lower()

    @classmethod
    def known(cls, space: Space) -> tuple[ContactPhase, ...]:
        """The possible phases of a contact."""
        return tuple(map(cls, space.phases))


SLIPS_ALONG_ONE_TANGENT = (
    ContactPhase.SLIP_X_FORWARD,
    ContactPhase.SLIP_X_BACKWARD,
    ContactPhase.SLIP_Y_FORWARD,
    ContactPhase.SLIP_Y_BACKWARD,
)
"""Phases of the pyramid in which one tangent sticks."""

SLIPS_ALONG_BOTH_TANGENTS = (
    ContactPhase.SLIP_X_FORWARD_Y_FORWARD,
    ContactPhase.SLIP_X_FORWARD_Y_BACKWARD,
    ContactPhase.SLIP_X_BACKWARD_Y_FORWARD,
    ContactPhase.SLIP_X_BACKWARD_Y_BACKWARD,
)
"""The other slip phases of the pyramid."""


class Outcome(StrEnum):
    """Outcome of a run (docs/model.md, Outcomes)."""

    COMPLETED = "completed"
    SEPARATED = "separated"
    LEFT_FACE = "left_face"
    SINGULAR = "singular"
    CHATTERING = "chattering"
    INCONSISTENT = "inconsistent"
    DIVERGED = "diverged"
    LIMIT = "limit"
    STOPPED = "stopped"
    FAILED = "failed"
    RECOVERED = "recovered"

    @property
    def ended_by_physics(self) -> bool:
        """Whether the model itself, not a person, limit or machine, ended the run early."""
        return self in _PHYSICAL


_PHYSICAL = {
    Outcome.SEPARATED,
    Outcome.LEFT_FACE,
    Outcome.SINGULAR,
    Outcome.CHATTERING,
    Outcome.INCONSISTENT,
    Outcome.DIVERGED,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseChange:
    """A transition of a contact from one phase to another at ``time`` [s]."""

    time: float
    contact: int
    from_phase: ContactPhase
    to_phase: ContactPhase


@dataclass(frozen=True, slots=True, kw_only=True)
class Reason:
    """Reason for the early end of a run.

    Attributes:
        code: Stable word for programs.
        message: Description for people.
        contact: Index of the contact or finger responsible, if any.
        time: Simulation time [s].
        value: The offending quantity, SI.
        limit: The limit that it exceeded, SI.
        hint: Suggestion by the version that wrote it.
    """

    code: str
    message: str
    contact: int | None
    time: float
    value: float | None
    limit: float | None
    hint: str = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunWarning:
    """A warning about a run, with its count."""

    code: str
    message: str
    count: int
    first_time: float
