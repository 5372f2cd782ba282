"""The desk of the picture: where it is seen from, and how it looks."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from slipgrasp.web.model.camera import FrontCamera
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.picture import (
    CameraMoved,
    FrameHand,
    PageMeasured,
    SetLook,
    ToggleDark,
)
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.reducers.reducer import Desk


class PictureDesk(Desk):
    """Keeps the hand in the picture, and draws it as the user likes.

    Args:
        camera: The viewer's camera.
    """

    takes: ClassVar[tuple[type[Intent], ...]] = (
        CameraMoved,
        FrameHand,
        PageMeasured,
        SetLook,
        ToggleDark,
    )

    def __init__(self, camera: FrontCamera) -> None:
        self._camera = camera

    def take(self, intent: Intent, view: ViewState) -> ViewState:
        """Takes note of the camera, puts it in front of the hand again, or changes the look."""
        match intent:
            case CameraMoved(position):
                self._camera.report(position)
            case PageMeasured():
                return self._fit(intent, view)
            case FrameHand():
                self._camera.frame()
            case SetLook(look):
                return replace(view, look=look.within_bounds())
            case ToggleDark():
                return replace(view, look=replace(view.look, dark=not view.look.dark))
        return view

    def _fit(self, measured: PageMeasured, view: ViewState) -> ViewState:
        """Takes note of the page's room; what it prefers counts until its user chooses."""
        self._camera.measure(measured.room.picture)
        is_first = view.room is None
        look = replace(view.look, dark=measured.prefers_dark) if is_first else view.look
        return replace(view, room=measured.room, look=look)
