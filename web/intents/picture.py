"""Intents about the picture: where it is seen from."""

from __future__ import annotations

from dataclasses import dataclass

from web.intents.intent import Intent, LatestIntent

__all__ = ["CameraMoved", "FrameHand"]


@dataclass(frozen=True, slots=True)
class FrameHand(Intent):
    """The user wants to see the whole hand from the front again."""


@dataclass(frozen=True, slots=True)
class CameraMoved(LatestIntent):
    """The viewer reports its camera: position [m] and size of its picture [px]."""

    position: tuple[float, float, float]
    width: int
    height: int
