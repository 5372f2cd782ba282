"""The desk of the picture: where it is seen from."""

from __future__ import annotations

from typing import ClassVar

from web.camera import FrontCamera
from web.desks.desk import Desk
from web.intents.intent import Intent
from web.intents.picture import CameraMoved, FrameHand
from web.view import ViewState

__all__ = ["PictureDesk"]


class PictureDesk(Desk):
    """Keeps the hand in the picture.

    Args:
        camera: The viewer's camera.
    """

    takes: ClassVar[tuple[type[Intent], ...]] = (CameraMoved, FrameHand)

    def __init__(self, camera: FrontCamera) -> None:
        self._camera = camera

    def take(self, intent: Intent, view: ViewState) -> ViewState:
        """Takes note of the camera, or puts it in front of the hand again."""
        match intent:
            case CameraMoved(position, width, height):
                self._camera.report(position, width, height)
            case FrameHand():
                self._camera.frame()
        return view
