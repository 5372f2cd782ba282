"""Intents about the view, the page layout, and the charts."""

from __future__ import annotations

from typing import Annotated

from annotated_types import MaxLen

from slipgrasp.server.tokens import Right
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.charts_view import MAX_LAYOUT
from slipgrasp.web.model.intents.intent import Intent, LatestIntent
from slipgrasp.web.model.page_layout import PageLayout


class FrameHand(Intent, right=Right.READ):
    """Restores the front view, of the object or of the whole hand."""

    whole: bool = False


class RestoreLayout(Intent, right=Right.READ):
    """Restores the layout of the panels."""


class CameraMoved(LatestIntent):
    """The viewer reports the position of its camera [m]."""

    position: tuple[float, float, float]


class MeasurePage(LatestIntent, right=Right.READ):
    """The page reports its size, and whether its user prefers dark pages."""

    layout: PageLayout
    prefers_dark: bool


class SetAppearance(LatestIntent):
    """Changes display options; numbers are not validated yet."""

    appearance: Appearance


class ToggleDark(Intent):
    """Toggles between a dark and a light page."""


class ToggleLecture(Intent, right=Right.READ):
    """Toggles the lecture layout."""


class ToggleLine(Intent, right=Right.READ):
    """Hides a line, or shows it again; the keys are not validated yet."""

    chart: Annotated[str, MaxLen(40)]
    line: Annotated[str, MaxLen(40)]


class ToggleSignal(Intent, right=Right.READ):
    """Adds a signal to the charts, by its name or part of it, or removes it."""

    name: Annotated[str, MaxLen(80)]


class DrawAgainst(LatestIntent, right=Right.READ):
    """Plots the selected signals against another one; empty for none."""

    name: Annotated[str, MaxLen(80)]


class PlaceMark(LatestIntent, right=Right.READ):
    """Moves the second cursor of the charts to a time [s]."""

    time: float


class ToggleMark(Intent, right=Right.READ):
    """Sets the second cursor at the play head, or removes it."""


class LayOutCharts(LatestIntent, right=Right.READ):
    """The page opens with a layout of the charts, which is not validated yet."""

    layout: Annotated[str, MaxLen(MAX_LAYOUT)]


class SeeCharts(Intent, right=Right.READ):
    """The page reports that a tab of the charts became visible, or invisible."""

    tab: Annotated[str, MaxLen(20)]
    is_visible: bool
