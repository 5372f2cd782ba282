"""Intents about what is drawn: the picture of the hand, the page around it, and the charts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from annotated_types import MaxLen

from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.charts_view import MAX_LAYOUT
from slipgrasp.web.model.intents.intent import Intent, LatestIntent
from slipgrasp.web.model.page_layout import PageLayout


@dataclass(frozen=True, slots=True)
class FrameHand(Intent):
    """The user wants to look from the front again, at what is held or at the whole hand."""

    whole: bool = False


@dataclass(frozen=True, slots=True)
class RestoreLayout(Intent):
    """The user wants the panels back where they were at first."""


@dataclass(frozen=True, slots=True)
class CameraMoved(LatestIntent):
    """The viewer reports where its camera stands [m]."""

    position: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class MeasurePage(LatestIntent):
    """The page reports its size, and whether its user prefers dark pages."""

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
class ToggleLecture(Intent):
    """The user lays the page out for a lecture hall, or for work at a desk."""


@dataclass(frozen=True, slots=True)
class ToggleLine(Intent):
    """The user wants a line hidden, or back; the keys are not validated yet."""

    chart: Annotated[str, MaxLen(40)]
    line: Annotated[str, MaxLen(40)]


@dataclass(frozen=True, slots=True)
class ToggleSignal(Intent):
    """The user wants a signal in the charts by its name or a part of it, or out of them."""

    name: Annotated[str, MaxLen(80)]


@dataclass(frozen=True, slots=True)
class DrawAgainst(LatestIntent):
    """The user wants the chosen signals against another; empty is against none any more."""

    name: Annotated[str, MaxLen(80)]


@dataclass(frozen=True, slots=True)
class PlaceMark(LatestIntent):
    """The user put the second cursor of the charts to a time [s]."""

    time: float


@dataclass(frozen=True, slots=True)
class ToggleMark(Intent):
    """The user wants the second cursor where the play head stands, or away if there is one."""


@dataclass(frozen=True, slots=True)
class LayOutCharts(LatestIntent):
    """The page opens with a layout of the charts; it is not validated yet."""

    layout: Annotated[str, MaxLen(MAX_LAYOUT)]


@dataclass(frozen=True, slots=True)
class SeeCharts(Intent):
    """The page reports that a tab of the charts became visible, or invisible."""

    tab: Annotated[str, MaxLen(20)]
    is_visible: bool
