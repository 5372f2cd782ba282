"""Topics for Foxglove and Rerun: poses and shapes of hand and object."""

from slipgrasp.recordings.file.foxglove.layouts import (
    DISPLAY_RATE,
    SCENE_TOPIC,
    TRANSFORMS_TOPIC,
    DisplayLayout,
    FrameClock,
    display_layouts,
)

__all__ = [
    "DISPLAY_RATE",
    "SCENE_TOPIC",
    "TRANSFORMS_TOPIC",
    "DisplayLayout",
    "FrameClock",
    "display_layouts",
]
