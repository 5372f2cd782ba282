"""The one palette: every phase, finger and surface keeps its colour on screen and on paper.

The phase colours are after Okabe and Ito; blue is darker and purple lighter than theirs,
which people who see no red could hardly tell apart.
"""

from __future__ import annotations

from core.types import ContactPhase

__all__ = [
    "CONE",
    "FINGERS",
    "GHOST",
    "GROUND",
    "JOINT",
    "LINK",
    "MARK",
    "MOUNT",
    "MUTED",
    "OBJECT",
    "OBJECT_EDGE",
    "PHASES",
    "SHADE",
    "Rgb",
]

Rgb = tuple[int, int, int]

PHASES: dict[ContactPhase, Rgb] = {
    ContactPhase.STICK: (0, 85, 150),
    ContactPhase.SLIP_FORWARD: (230, 97, 0),
    ContactPhase.SLIP_BACKWARD: (226, 120, 190),
}

FINGERS: tuple[Rgb, ...] = (
    (0, 133, 97),
    (92, 70, 156),
    (138, 104, 0),
    (60, 60, 60),
    (0, 140, 160),
    (150, 60, 60),
)
"""Lines of a chart, one colour per finger; none of them is a phase colour."""

LINK: Rgb = (148, 158, 172)
JOINT: Rgb = (64, 74, 90)
MOUNT: Rgb = (88, 98, 114)
GROUND: Rgb = (176, 182, 190)
OBJECT: Rgb = (226, 221, 208)
OBJECT_EDGE: Rgb = (120, 112, 96)
GHOST: Rgb = (0, 133, 97)
"""Outline of the pose that the object should have."""
CONE: Rgb = (70, 76, 88)
MUTED: Rgb = (120, 128, 140)
MARK: Rgb = (30, 30, 30)
SHADE: Rgb = (230, 97, 0)
"""Behind a chart while any contact slips."""
