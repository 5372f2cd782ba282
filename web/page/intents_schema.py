"""JSON schema of the intents that a page may post, for gestures without a viser widget.

The page posts ``{"kind": "step", "direction": 1}`` for ``Step(1)``: the kind is the name of the
intent, and its fields are validated by their annotations.
"""

from __future__ import annotations

import re
from dataclasses import asdict, is_dataclass
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, RootModel, create_model

from slipgrasp.server.tokens import Right
from slipgrasp.web.model.intents import (
    compare,
    heavier,
    picture,
    playback,
    premises,
    recordings,
    scenario,
    selection,
    study,
    tour,
)
from slipgrasp.web.model.intents.intent import Intent

MAX_GESTURES = 20

_MODULES = (
    compare,
    heavier,
    picture,
    playback,
    premises,
    recordings,
    scenario,
    selection,
    study,
    tour,
)
RIGHTS: dict[type[Intent], Right] = {
    intent: intent.right
    for module in _MODULES
    for intent in vars(module).values()
    if isinstance(intent, type) and issubclass(intent, Intent) and intent.right > Right.NOTHING
}
"""The only intents that a page may post, each with the right that it requires."""


def _kind_of(intent: type[Intent]) -> str:
    """The name of an intent in JSON, such as ``jump-to-event``."""
    return re.sub(r"(?<!^)(?=[A-Z])", "-", intent.__name__).lower()


KINDS: dict[type[Intent], str] = {intent: _kind_of(intent) for intent in RIGHTS}
"""The name of each intent that the page may post."""


def posted(intent: Intent) -> dict[str, Any]:
    """The JSON of an intent."""
    return {"kind": KINDS[type(intent)], **asdict(intent)}


class _Gesture(BaseModel):
    """Validated JSON: an intent, or part of one."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


def _gesture_model(made: type[Any], **kind: Any) -> type[_Gesture]:
    """The validated fields of a dataclass."""
    hints = get_type_hints(made, include_extras=True)
    allowed: dict[str, Any] = {
        name: (_gesture_model(hint) if isinstance(hint, type) and is_dataclass(hint) else hint, ...)
        for name, hint in hints.items()
    }
    return create_model(made.__name__, __base__=_Gesture, **kind, **allowed)


def _built(made: type[Any], value: Any) -> Any:
    """The dataclass of validated fields; other values as they are."""
    if not isinstance(value, _Gesture):
        return value
    hints = get_type_hints(made)
    return made(**{name: _built(hint, getattr(value, name)) for name, hint in hints.items()})


_MODELS = {
    _gesture_model(intent, kind=(Literal[kind], ...)): intent for intent, kind in KINDS.items()
}
_AnyGesture = Annotated[reduce(or_, _MODELS), Field(discriminator="kind")]


class PageGestures(RootModel[list[_AnyGesture]]):
    """A batch of intents, in order."""

    root: list[_AnyGesture] = Field(max_length=MAX_GESTURES)

    def intents(self) -> list[Intent]:
        """The intents that were posted, in order."""
        return [_built(_MODELS[type(gesture)], gesture) for gesture in self.root]
