"""How often a session draws, and when it keeps a run."""

from __future__ import annotations

from web.view import RunStage

__all__ = ["FRAME_INTERVAL", "is_save_due"]

FRAME_INTERVAL = 1.0 / 30.0
"""Time from one frame to the next while the play head moves [s]."""

_REST_BEFORE_SAVING = 0.5


def is_save_due(stage: RunStage, rested: float) -> bool:
    """Whether the run on the screen is to be kept now.

    Args:
        stage: How far the latest request has come.
        rested: How long ago a knob was moved last [s].
    """
    return stage is RunStage.PREVIEW and rested >= _REST_BEFORE_SAVING
