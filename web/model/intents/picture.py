"""Intents about what is drawn: the picture of the hand, the page around it, and the charts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from annotated_types import MaxLen

from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.intents.intent import Intent, LatestIntent
from slipgrasp.web.model.page_layout import PageLayout


@dataclass(frozen=True, slots=True)
class FrameHand(Intent):
    """The user wants to see the whole hand from the front again."""


@dataclass(frozen=True, slots=True)
class CameraMoved(LatestIntent):
    """The viewer reports where its camera stands [m]."""

    position: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class MeasurePage(LatestIntent):
    """The page tells how much room it has, and whether its user likes pages to be dark."""

    layout: PageLayout
    prefers_dark: bool


@dataclass(frozen=True, slots=True)
class SetAppearance(LatestIntent):
    """The user chose what is drawn; its numbers are not validated yet."""

    appearance: Appearance


@dataclass(frozen=True, slots=True)
class ToggleDark(Intent):
    """The user wants the page dark if it is bright, and bright if it is dark."""


@dataclass(frozen=True, slots=True)
class ToggleLine(Intent):
    """The user wants a line hidden, or back; the keys are not validated yet."""

    chart: Annotated[str, MaxLen(40)]
    line: Annotated[str, MaxLen(40)]


@dataclass(frozen=True, slots=True)
class ToggleSignal(Intent):
    """The user wants a signal in the charts, or out of them; the name is not validated yet."""

    name: Annotated[str, MaxLen(80)]
