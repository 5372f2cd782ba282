"""Colours of phases, fingers and surfaces, common to the dashboard and figures.

The phase colours are based on Okabe and Ito, with a darker blue, a lighter purple and a modified
vermillion, because people with protanopia can hardly distinguish the original ones.
"""

from __future__ import annotations

from slipgrasp.core.trace.types import (
    SLIPS_ALONG_BOTH_TANGENTS,
    SLIPS_ALONG_ONE_TANGENT,
    ContactPhase,
    Outcome,
)

Rgb = tuple[int, int, int]

PHASES: dict[ContactPhase, Rgb] = {
    ContactPhase.STICK: (0, 85, 150),
    ContactPhase.SLIP_FORWARD: (230, 97, 0),
    ContactPhase.SLIP_BACKWARD: (226, 120, 190),
    ContactPhase.SLIP: (230, 97, 0),
    **dict.fromkeys(SLIPS_ALONG_ONE_TANGENT, (230, 97, 0)),
    **dict.fromkeys(SLIPS_ALONG_BOTH_TANGENTS, (226, 120, 190)),
}

FINGERS: tuple[Rgb, ...] = (
    (0, 133, 97),
    (92, 70, 156),
    (138, 104, 0),
    (60, 60, 60),
    (0, 140, 160),
    (150, 60, 60),
)
"""Colours of lines in a chart, one per finger, distinct from phase colours."""

LINK: Rgb = (148, 158, 172)
JOINT: Rgb = (64, 74, 90)
MOUNT: Rgb = (88, 98, 114)
GROUND: Rgb = (176, 182, 190)
OBJECT: Rgb = (226, 221, 208)
OBJECT_EDGE: Rgb = (120, 112, 96)
GHOST: Rgb = (0, 133, 97)
"""Outline of the desired pose of the object."""
CONE: Rgb = (70, 76, 88)
LENS: Rgb = (247, 248, 250)
"""Background of a close-up from the side."""
WATER: Rgb = (96, 200, 226)
"""A low-friction patch."""
MUTED: Rgb = (120, 128, 140)
MARK: Rgb = (30, 30, 30)
SHADE: Rgb = (230, 97, 0)
"""Background of a chart during slip of any contact."""

HELD: Rgb = PHASES[ContactPhase.STICK]
"""Runs of a study that hold the object; the darkest colour of a map, also in greyscale."""
OUTCOMES: dict[Outcome, Rgb] = {
    Outcome.COMPLETED: (240, 160, 90),
    Outcome.LEFT_FACE: (236, 178, 216),
    Outcome.SEPARATED: (247, 228, 150),
    Outcome.CHATTERING: (126, 200, 170),
    Outcome.INCONSISTENT: (190, 190, 196),
    Outcome.DIVERGED: (222, 132, 104),
    Outcome.SINGULAR: (172, 156, 210),
    Outcome.LIMIT: (160, 200, 228),
    Outcome.STOPPED: (226, 228, 232),
    Outcome.RECOVERED: (226, 228, 232),
    Outcome.FAILED: (250, 250, 250),
}
"""Runs of a study that do not hold the object, by outcome.

Those that completed still slip, have only just stopped, exceed a limit, or are too short to judge.
"""
