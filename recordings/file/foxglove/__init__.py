"""Topics that Foxglove and Rerun draw: where hand and object are, and what they look like."""

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
