"""What a page may post: gestures that viser has no widget for, checked and made into intents."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, RootModel

from web.intents.intent import Intent
from web.intents.link import OpenLink
from web.intents.picture import FrameHand
from web.intents.playback import (
    ChangeSpeed,
    ChooseWindow,
    GoToEdge,
    JumpToEvent,
    Seek,
    SetSpeed,
    ShowWindow,
    Step,
    TogglePlay,
    Zoom,
)
from web.playback import WindowChoice

__all__ = ["MAX_GESTURES", "Gesture", "PageGestures"]

MAX_GESTURES = 20

_Direction = Literal[-1, 1]


class Gesture(BaseModel):
    """Something that the page's script asks for; ``kind`` says what."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    @abstractmethod
    def intent(self) -> Intent:
        """The same for the session."""


class _TogglePlay(Gesture):
    kind: Literal["toggle-play"]

    def intent(self) -> Intent:
        return TogglePlay()


class _Seek(Gesture):
    kind: Literal["seek"]
    time: float

    def intent(self) -> Intent:
        return Seek(self.time)


class _Step(Gesture):
    kind: Literal["step"]
    direction: _Direction

    def intent(self) -> Intent:
        return Step(self.direction)


class _JumpToEvent(Gesture):
    kind: Literal["jump-to-event"]
    direction: _Direction

    def intent(self) -> Intent:
        return JumpToEvent(self.direction)


class _GoToEdge(Gesture):
    kind: Literal["go-to-edge"]
    direction: _Direction

    def intent(self) -> Intent:
        return GoToEdge(self.direction)


class _SetSpeed(Gesture):
    kind: Literal["set-speed"]
    name: str = Field(max_length=10)

    def intent(self) -> Intent:
        return SetSpeed(self.name)


class _ChangeSpeed(Gesture):
    kind: Literal["change-speed"]
    direction: _Direction

    def intent(self) -> Intent:
        return ChangeSpeed(self.direction)


class _ChooseWindow(Gesture):
    kind: Literal["choose-window"]
    choice: Literal["slip", "whole run"]

    def intent(self) -> Intent:
        return ChooseWindow(WindowChoice(self.choice))


class _ShowWindow(Gesture):
    kind: Literal["show-window"]
    start: float
    end: float

    def intent(self) -> Intent:
        return ShowWindow(self.start, self.end)


class _Zoom(Gesture):
    kind: Literal["zoom"]

    def intent(self) -> Intent:
        return Zoom()


class _FrameHand(Gesture):
    kind: Literal["frame-hand"]

    def intent(self) -> Intent:
        return FrameHand()


class _OpenLink(Gesture):
    kind: Literal["open-link"]
    run: str = Field(max_length=200)
    time: str = Field(max_length=40)

    def intent(self) -> Intent:
        return OpenLink(self.run, self.time)


_AnyGesture = Annotated[
    _TogglePlay
    | _Seek
    | _Step
    | _JumpToEvent
    | _GoToEdge
    | _SetSpeed
    | _ChangeSpeed
    | _ChooseWindow
    | _ShowWindow
    | _Zoom
    | _FrameHand
    | _OpenLink,
    Field(discriminator="kind"),
]


class PageGestures(RootModel[list[_AnyGesture]]):
    """What a page posts at once, in the order in which it was done."""

    root: list[_AnyGesture] = Field(max_length=MAX_GESTURES)

    def intents(self) -> list[Intent]:
        """The same for the session, in order."""
        return [gesture.intent() for gesture in self.root]
