"""The reducer of the view: camera and appearance."""

from __future__ import annotations

from dataclasses import replace

from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.picture import (
    CameraMoved,
    FrameHand,
    MeasurePage,
    RestoreLayout,
    SetAppearance,
    ToggleDark,
    ToggleLecture,
)
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.scene.camera import FrontCamera


class PictureReducer(Reducer):
    """Keeps the hand in the view, with the user's display options.

    Args:
        camera: The viewer's camera.
    """

    def __init__(self, camera: FrontCamera) -> None:
        self._camera = camera

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Records the camera, resets it to the front, or changes the appearance."""
        look = view.appearance
        match intent:
            case CameraMoved(position):
                self._camera.report(position)
            case MeasurePage():
                return self._fit(intent, view)
            case FrameHand(whole):
                self._camera.frame()
                return replace(view, appearance=replace(look, whole_hand=whole))
            case RestoreLayout():
                return replace(view, restored=view.restored + 1)
            case SetAppearance(appearance):
                return replace(view, appearance=appearance.within_bounds())
            case ToggleDark():
                return replace(view, appearance=replace(look, dark=not look.dark))
            case ToggleLecture():
                return replace(view, appearance=replace(look, lecture=not look.lecture))
        return view

    def _fit(self, measured: MeasurePage, view: ViewState) -> ViewState:
        """Records the page's size; its preference counts until the user chooses."""
        self._camera.measure(measured.layout.picture)
        is_first = view.page_layout is None
        appearance = (
            replace(view.appearance, dark=measured.prefers_dark) if is_first else view.appearance
        )
        return replace(view, page_layout=measured.layout, appearance=appearance)
