"""The one palette: every phase, finger and surface keeps its colour everywhere.

The phase colours are after Okabe and Ito; blue is darker and purple lighter than theirs,
which people who see no red could hardly tell apart.
"""

from __future__ import annotations

from core.types import ContactPhase

__all__ = [
    "AMBER",
    "BELIEVED_CONE",
    "CONE",
    "FINGERS",
    "GHOST",
    "GROUND",
    "JOINT",
    "LENS",
    "LINK",
    "MARK",
    "MOUNT",
    "MUTED",
    "OBJECT",
    "OBJECT_EDGE",
    "PHASES",
    "SHADE",
    "Rgb",
    "css",
    "glow",
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
LENS: Rgb = (247, 248, 250)
CONE: Rgb = (70, 76, 88)
BELIEVED_CONE: Rgb = (150, 156, 168)
MUTED: Rgb = (120, 128, 140)
MARK: Rgb = (30, 30, 30)
SHADE: Rgb = (230, 97, 0)
AMBER: Rgb = (178, 116, 0)


def glow(colour: Rgb) -> Rgb:
    """The colour as viser wants it for lines and arrows, so that it looks like the colour itself.

    Their vertex colours are taken as linear light, those of meshes and of CSS as sRGB.
    """
    red, green, blue = (round(255.0 * _to_linear(channel / 255.0)) for channel in colour)
    return (red, green, blue)


def _to_linear(channel: float) -> float:
    return channel / 12.92 if channel <= 0.04045 else ((channel + 0.055) / 1.055) ** 2.4


def css(colour: Rgb, opacity: float = 1.0) -> str:
    """The colour as CSS, with an opacity from 0 to 1."""
    red, green, blue = colour
    return f"rgba({red},{green},{blue},{opacity:g})"
