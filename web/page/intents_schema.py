"""What a page may post: gestures that viser has no widget for, checked and made into intents."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, RootModel

from slipgrasp.web.model.intents.compare import EndComparison, SwapRuns
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.picture import FrameHand, MeasurePage, ToggleLine
from slipgrasp.web.model.intents.playback import (
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
from slipgrasp.web.model.intents.recordings import (
    ChooseRecording,
    ListRecordings,
    OpenLink,
    OpenRecording,
)
from slipgrasp.web.model.intents.scenario import (
    Redo,
    RemoveChange,
    RemoveChanges,
    RemoveDisturbance,
    Undo,
)
from slipgrasp.web.model.intents.study import OpenStudyRun, SeeStudyDraft
from slipgrasp.web.model.page_layout import PageLayout
from slipgrasp.web.model.playback import WindowChoice

MAX_GESTURES = 20
MAX_ID_LENGTH = 100
MAX_PAGE = 1_000_000

_Direction = Literal[-1, 1]
_Pixels = Annotated[int, Field(ge=0, le=20_000)]


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


class _MeasurePage(Gesture):
    kind: Literal["measure-page"]
    width: _Pixels
    height: _Pixels
    scene_width: _Pixels
    scene_height: _Pixels
    covered: _Pixels
    prefers_dark: bool

    def intent(self) -> Intent:
        room = PageLayout(
            self.width, self.height, self.scene_width, self.scene_height, self.covered
        )
        return MeasurePage(room, self.prefers_dark)


class _ToggleLine(Gesture):
    kind: Literal["toggle-line"]
    chart: str = Field(max_length=40)
    line: str = Field(max_length=40)

    def intent(self) -> Intent:
        return ToggleLine(self.chart, self.line)


class _OpenLink(Gesture):
    kind: Literal["open-link"]
    run: str = Field(max_length=200)
    time: str = Field(max_length=40)

    def intent(self) -> Intent:
        return OpenLink(self.run, self.time)


class _ListRecordings(Gesture):
    kind: Literal["list-recordings"]
    page: int = Field(ge=0, le=MAX_PAGE)

    def intent(self) -> Intent:
        return ListRecordings(self.page)


class _ChooseRecording(Gesture):
    kind: Literal["choose-recording"]
    run_id: str = Field(max_length=MAX_ID_LENGTH)

    def intent(self) -> Intent:
        return ChooseRecording(self.run_id)


class _OpenRecording(Gesture):
    kind: Literal["open-recording"]
    run_id: str = Field(max_length=MAX_ID_LENGTH)

    def intent(self) -> Intent:
        return OpenRecording(self.run_id)


class _OpenStudyRun(Gesture):
    kind: Literal["open-study-run"]
    index: int = Field(ge=0, le=10**9)

    def intent(self) -> Intent:
        return OpenStudyRun(self.index)


class _SeeStudyDraft(Gesture):
    kind: Literal["see-study-draft"]
    is_visible: bool

    def intent(self) -> Intent:
        return SeeStudyDraft(self.is_visible)


class _Undo(Gesture):
    kind: Literal["undo"]

    def intent(self) -> Intent:
        return Undo()


class _Redo(Gesture):
    kind: Literal["redo"]

    def intent(self) -> Intent:
        return Redo()


class _RemoveChange(Gesture):
    kind: Literal["remove-change"]
    time: float
    key: str = Field(max_length=MAX_ID_LENGTH)

    def intent(self) -> Intent:
        return RemoveChange(self.time, self.key)


class _RemoveDisturbance(Gesture):
    kind: Literal["remove-disturbance"]
    index: int = Field(ge=0, le=10**6)

    def intent(self) -> Intent:
        return RemoveDisturbance(self.index)


class _SwapRuns(Gesture):
    kind: Literal["swap-runs"]

    def intent(self) -> Intent:
        return SwapRuns()


class _RemoveChanges(Gesture):
    kind: Literal["remove-changes"]

    def intent(self) -> Intent:
        return RemoveChanges()


class _EndComparison(Gesture):
    kind: Literal["end-comparison"]

    def intent(self) -> Intent:
        return EndComparison()


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
    | _MeasurePage
    | _OpenLink
    | _ToggleLine
    | _ListRecordings
    | _ChooseRecording
    | _OpenRecording
    | _Undo
    | _Redo
    | _RemoveChange
    | _RemoveChanges
    | _RemoveDisturbance
    | _SwapRuns
    | _EndComparison
    | _OpenStudyRun
    | _SeeStudyDraft,
    Field(discriminator="kind"),
]


class PageGestures(RootModel[list[_AnyGesture]]):
    """What a page posts at once, in the order in which it was done."""

    root: list[_AnyGesture] = Field(max_length=MAX_GESTURES)

    def intents(self) -> list[Intent]:
        """The same for the session, in order."""
        return [gesture.intent() for gesture in self.root]
