"""When the loop of a session draws, and when it keeps a run."""

from __future__ import annotations

from web.view import RunStage

__all__ = ["frame_wait", "is_save_due"]

_REST_BEFORE_SAVING = 0.5
_FRAME_INTERVAL = 1.0 / 25.0


def is_save_due(stage: RunStage, rested: float) -> bool:
    """Whether the run on the screen is to be kept now.

    Args:
        stage: How far the latest request has come.
        rested: How long ago a knob was moved last [s].
    """
    return stage is RunStage.PREVIEW and rested >= _REST_BEFORE_SAVING


def frame_wait(playing: bool, stage: RunStage, waiting: bool, since_frame: float) -> float | None:
    """How long the loop may sleep while no intent comes [s]; None is for as long as it likes.

    Args:
        playing: Whether the play head moves.
        stage: How far the latest request has come.
        waiting: Whether a run is being computed.
        since_frame: How long ago the last frame was begun [s].
    """
    if playing:
        return max(_FRAME_INTERVAL - since_frame, 0.0)
    return 0.1 if waiting or stage is RunStage.PREVIEW else None
