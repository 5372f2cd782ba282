"""Intents about the view, the page layout, and the charts."""

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
    """Restores the front view, of the object or of the whole hand."""

    whole: bool = False


@dataclass(frozen=True, slots=True)
class RestoreLayout(Intent):
    """Restores the layout of the panels."""


@dataclass(frozen=True, slots=True)
class CameraMoved(LatestIntent):
    """The viewer reports the position of its camera [m]."""

    position: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class MeasurePage(LatestIntent):
    """The page reports its size, and whether its user prefers dark pages."""

    layout: PageLayout
    prefers_dark: bool


@dataclass(frozen=True, slots=True)
class SetAppearance(LatestIntent):
    """Changes display options; numbers are not validated yet."""

    appearance: Appearance


@dataclass(frozen=True, slots=True)
class ToggleDark(Intent):
    """Toggles between a dark and a light page."""


@dataclass(frozen=True, slots=True)
class ToggleLecture(Intent):
    """Toggles the lecture layout."""


@dataclass(frozen=True, slots=True)
class ToggleLine(Intent):
    """Hides a line, or shows it again; the keys are not validated yet."""

    chart: Annotated[str, MaxLen(40)]
    line: Annotated[str, MaxLen(40)]


@dataclass(frozen=True, slots=True)
class ToggleSignal(Intent):
    """Adds a signal to the charts, by its name or part of it, or removes it."""

    name: Annotated[str, MaxLen(80)]


@dataclass(frozen=True, slots=True)
class DrawAgainst(LatestIntent):
    """Plots the selected signals against another one; empty for none."""

    name: Annotated[str, MaxLen(80)]


@dataclass(frozen=True, slots=True)
class PlaceMark(LatestIntent):
    """Moves the second cursor of the charts to a time [s]."""

    time: float


@dataclass(frozen=True, slots=True)
class ToggleMark(Intent):
    """Sets the second cursor at the play head, or removes it."""


@dataclass(frozen=True, slots=True)
class LayOutCharts(LatestIntent):
    """The page opens with a layout of the charts, which is not validated yet."""

    layout: Annotated[str, MaxLen(MAX_LAYOUT)]


@dataclass(frozen=True, slots=True)
class SeeCharts(Intent):
    """The page reports that a tab of the charts became visible, or invisible."""

    tab: Annotated[str, MaxLen(20)]
    is_visible: bool
