"""Colours of links, mounts and the object, for a light and a dark page."""

from __future__ import annotations

from typing import NamedTuple

from slipgrasp.recordings.palette import (
    GROUND,
    JOINT,
    LENS,
    LINK,
    MOUNT,
    MUTED,
    OBJECT,
    OBJECT_EDGE,
    Rgb,
)


class Surfaces(NamedTuple):
    """One colour per kind of surface; contacts have the same colours on any page.

    Attributes:
        link: Bars of the fingers.
        joint: Joints.
        mount: Mounts of the fingers.
        ground: The floor below.
        object: The object.
        object_edge: Outline of the object.
        lens: The background of a close-up.
        leader: Lines from the contacts to their close-ups.
        pale: Hand and object of a ghost.
        pale_edge: Outlines of a ghost.
        ink: Text.
        page: Background, and border of text.
    """

    link: Rgb
    joint: Rgb
    mount: Rgb
    ground: Rgb
    object: Rgb
    object_edge: Rgb
    lens: Rgb
    leader: Rgb
    pale: Rgb
    pale_edge: Rgb
    ink: Rgb
    page: Rgb


_BRIGHT = Surfaces(
    link=LINK,
    joint=JOINT,
    mount=MOUNT,
    ground=GROUND,
    object=OBJECT,
    object_edge=OBJECT_EDGE,
    lens=LENS,
    leader=MUTED,
    pale=(233, 236, 241),
    pale_edge=(164, 173, 188),
    ink=(28, 32, 40),
    page=(255, 255, 255),
)

_DARK = Surfaces(
    link=(132, 143, 160),
    joint=(44, 52, 66),
    mount=(84, 95, 114),
    ground=(104, 112, 126),
    object=(204, 199, 187),
    object_edge=(104, 97, 82),
    lens=(246, 247, 250),
    leader=(120, 128, 140),
    pale=(38, 43, 52),
    pale_edge=(104, 116, 138),
    ink=(232, 235, 240),
    page=(20, 20, 20),
)


def surfaces_for(*, dark: bool) -> Surfaces:
    """The colours for a dark or a bright page."""
    return _DARK if dark else _BRIGHT
