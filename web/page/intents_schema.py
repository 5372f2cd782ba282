"""What a page may post: intents that viser has no widget for, as JSON, written and read here.

The page posts ``{"kind": "step", "direction": 1}`` for ``Step(1)``: the kind is the name of the
intent, the rest are its fields, and their annotations say what is allowed.
"""

from __future__ import annotations

import re
from dataclasses import asdict, is_dataclass
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, RootModel, create_model

from slipgrasp.server.tokens import Right
from slipgrasp.web.model.intents.compare import EndComparison, SwapRuns
from slipgrasp.web.model.intents.heavier import AskHowHeavy
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.picture import (
    DrawAgainst,
    FrameHand,
    LayOutCharts,
    MeasurePage,
    PlaceMark,
    RestoreLayout,
    SeeCharts,
    ToggleLecture,
    ToggleLine,
    ToggleMark,
    ToggleSignal,
)
from slipgrasp.web.model.intents.playback import (
    ChangeSpeed,
    ChooseWindow,
    GoToEdge,
    GoToNextSlip,
    JumpToEvent,
    Seek,
    SetSpeed,
    ShowWindow,
    Step,
    TogglePlay,
    Zoom,
)
from slipgrasp.web.model.intents.premises import FindPremises
from slipgrasp.web.model.intents.recordings import (
    ChooseRecording,
    ListRecordings,
    OpenLink,
    OpenRecording,
)
from slipgrasp.web.model.intents.scenario import (
    AddDisturbance,
    ChooseLaw,
    Redo,
    RemoveChange,
    RemoveChanges,
    RemoveDisturbance,
    TryOut,
    Undo,
)
from slipgrasp.web.model.intents.selection import (
    FindParameters,
    Select,
    ToggleAllParameters,
)
from slipgrasp.web.model.intents.study import OpenStudyRun, SeeStudyDraft
from slipgrasp.web.model.intents.tour import ToggleTour, VisitStop

MAX_GESTURES = 20

_LOOKING: tuple[type[Intent], ...] = (
    TogglePlay,
    Seek,
    Step,
    JumpToEvent,
    GoToNextSlip,
    GoToEdge,
    SetSpeed,
    ChangeSpeed,
    ChooseWindow,
    ShowWindow,
    Zoom,
    FrameHand,
    RestoreLayout,
    MeasurePage,
    OpenLink,
    ToggleLine,
    ToggleSignal,
    DrawAgainst,
    PlaceMark,
    ToggleMark,
    ToggleLecture,
    LayOutCharts,
    SeeCharts,
    ListRecordings,
    ChooseRecording,
    OpenRecording,
    SwapRuns,
    EndComparison,
    FindPremises,
    Select,
    FindParameters,
    ToggleAllParameters,
)
_WORKING: tuple[type[Intent], ...] = (
    Undo,
    Redo,
    RemoveChange,
    RemoveChanges,
    AddDisturbance,
    RemoveDisturbance,
    TryOut,
    ChooseLaw,
    ToggleTour,
    VisitStop,
    AskHowHeavy,
    OpenStudyRun,
    SeeStudyDraft,
)
RIGHTS: dict[type[Intent], Right] = {
    **dict.fromkeys(_LOOKING, Right.READ),
    **dict.fromkeys(_WORKING, Right.EVERYTHING),
}
"""The only intents that a page may post, each with the right that it requires.

Intents that change a scenario or a study, or start a simulation, require the full token; those
that only show something require the read-only token.
"""


def _kind_of(intent: type[Intent]) -> str:
    """The name of an intent in JSON, such as ``jump-to-event``."""
    return re.sub(r"(?<!^)(?=[A-Z])", "-", intent.__name__).lower()


KINDS: dict[type[Intent], str] = {intent: _kind_of(intent) for intent in RIGHTS}
"""What the page calls each intent that it may post."""


def posted(intent: Intent) -> dict[str, Any]:
    """What the page posts for an intent."""
    return {"kind": KINDS[type(intent)], **asdict(intent)}


class _Gesture(BaseModel):
    """Something that the page posts, checked: an intent, or a part of one."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


def _gesture_model(made: type[Any], **kind: Any) -> type[_Gesture]:
    """The fields of a dataclass, each allowed what its annotation says."""
    hints = get_type_hints(made, include_extras=True)
    allowed: dict[str, Any] = {
        name: (_gesture_model(hint) if isinstance(hint, type) and is_dataclass(hint) else hint, ...)
        for name, hint in hints.items()
    }
    return create_model(made.__name__, __base__=_Gesture, **kind, **allowed)


def _built(made: type[Any], gesture: _Gesture) -> Any:
    """The dataclass whose fields were checked."""
    values = {name: (hint, getattr(gesture, name)) for name, hint in get_type_hints(made).items()}
    return made(
        **{
            name: _built(hint, value) if isinstance(value, _Gesture) else value
            for name, (hint, value) in values.items()
        }
    )


_MODELS = {
    _gesture_model(intent, kind=(Literal[kind], ...)): intent for intent, kind in KINDS.items()
}
_AnyGesture = Annotated[reduce(or_, _MODELS), Field(discriminator="kind")]


class PageGestures(RootModel[list[_AnyGesture]]):
    """What a page posts at once, in the order in which it was done."""

    root: list[_AnyGesture] = Field(max_length=MAX_GESTURES)

    def intents(self) -> list[Intent]:
        """The intents that were posted, in order."""
        return [_built(_MODELS[type(gesture)], gesture) for gesture in self.root]
