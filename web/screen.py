"""The complete page of a user: scene and panels, drawn from one view."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from operator import is_
from typing import Protocol

import viser

from slipgrasp.core.scenario.hand_files.meshes import HandMeshes
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import PHASES, Rgb
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.picture import CameraMoved
from slipgrasp.web.model.page_layout import MARGIN, Arrangement, guess_layout, panel_sizes
from slipgrasp.web.model.view import Shown, ViewState
from slipgrasp.web.page.keys import RUN_TAB
from slipgrasp.web.panels.appearance_panel import AppearancePanel
from slipgrasp.web.panels.charts_panel import ChartsPanel
from slipgrasp.web.panels.compare_panel import ComparePanel
from slipgrasp.web.panels.controls_panel import ControlsPanel
from slipgrasp.web.panels.export_panel import ExportPanel
from slipgrasp.web.panels.fit_panel import FitPanel
from slipgrasp.web.panels.outcome_panel import OutcomePanel
from slipgrasp.web.panels.playback_panel import PlaybackPanel
from slipgrasp.web.panels.recordings_panel import RecordingsPanel
from slipgrasp.web.panels.scenario_file_panel import ScenarioFilePanel
from slipgrasp.web.panels.scenario_panel import ScenarioPanel
from slipgrasp.web.panels.session_state_panel import SessionStatePanel
from slipgrasp.web.panels.study_panel import StudyPanel
from slipgrasp.web.panels.tour_panel import TourPanel
from slipgrasp.web.scene.camera import FrontCamera
from slipgrasp.web.scene.dragging import ObjectDrag
from slipgrasp.web.scene.picking import Picking
from slipgrasp.web.scene.scene import Scene

_OTHER_TABS: tuple[tuple[str, viser.IconName], ...] = (
    ("Recordings", viser.Icon.LIST),
    ("Compare", viser.Icon.ARROWS_DIFF),
    ("Study", viser.Icon.GRID_DOTS),
    ("Fit", viser.Icon.TARGET),
)
_PATIENCE = 3.0  # [s]
_BRIGHT_BRAND: Rgb = PHASES[ContactPhase.STICK]
_DARK_BRAND: Rgb = (92, 168, 236)


class Panel(Protocol):
    """A part of the page."""

    def update(self, view: ViewState) -> None:
        """Draws a view."""
        ...


class Screen:
    """Owns all nodes and panels of one viewer.

    Args:
        client: The viewer.
        camera: Its camera.
        view: Initial view.
        send: Accepts the intents of its user.
        key: The key of the session, for the page's script.
        meshes: Meshes of a hand.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        camera: FrontCamera,
        view: ViewState,
        send: Send,
        key: str,
        meshes: HandMeshes | None = None,
    ) -> None:
        gui, self._gui = client.gui, client.gui
        self._scene = Scene(client, ObjectDrag(send), picking=Picking(send), meshes=meshes)
        self._camera = camera
        layout = guess_layout(client.camera.image_width, client.camera.image_height)
        sizes = panel_sizes(layout.width, layout.height)
        self._scenario = ScenarioPanel(gui, view.draft, send)
        self._results = gui.add_panel()
        with self._results.add_tab(RUN_TAB, viser.Icon.CHART_LINE) as run_tab:
            self._tour = TourPanel(gui, run_tab, send)
            self._outcome = OutcomePanel(gui)
            self._charts = ChartsPanel(client, sizes.chart)
        self._tabs = [self._results.add_tab(*tab) for tab in _OTHER_TABS]
        self._player = gui.add_panel()
        with self._player.add_tab("Playback", viser.Icon.PLAYER_PLAY):
            self._session_state = SessionStatePanel(gui, key)
            self._playback = PlaybackPanel(gui, send)
        # On a phone both are parts of one sheet, collapsed initially.
        self._results.expand()
        self._player.expand()
        self._is_wide = self._is_lecture = False
        self._arrangement: Arrangement | None = None
        self._restored = 0
        self._widths = (0, 0, 0)
        self._page_layout = layout
        self._fit()
        self._panels: tuple[Panel, ...] = (
            self._scenario,
            self._tour,
            self._outcome,
            self._playback,
            self._charts,
            self._session_state,
        )
        self._late: Callable[[ViewState], tuple[Panel, ...]] | None = partial(
            self._late_panels, send
        )
        self._latest = time.monotonic() + _PATIENCE
        self._of_run = (self._outcome, self._playback, self._charts, self._session_state)
        self._drawn: object = None
        self._instant: tuple[object, ...] = (None, None, None)
        self._dark = view.appearance.dark
        client.camera.on_update(lambda camera: send(_report(camera)))

    def update_scene(self, view: ViewState) -> None:
        """Draws the run at the play head; `update` then draws the rest."""
        if view.shown is not None:
            self._draw(view.shown, view)

    def update_run(self, view: ViewState) -> None:
        """Draws what a new run changes in sight; `update` then draws the rest."""
        self.update_scene(view)
        for panel in self._of_run:
            panel.update(view)

    def update(self, view: ViewState) -> None:
        """Draws a view; unchanged parts cost nothing."""
        if view.page_layout is not None and view.page_layout != self._page_layout:
            self._page_layout = view.page_layout
            self._fit()
        if view.restored != self._restored:
            self._restored, self._arrangement = view.restored, None
            self._fit()
            for panel in (self._results, self._gui.main_panel, self._player):
                panel.expand()
        if view.appearance.lecture != self._is_lecture:
            self._is_lecture = view.appearance.lecture
            self._lay_out_lecture()
        if view.appearance.dark != self._dark:
            self._dark = view.appearance.dark
            apply_theme(self._gui, dark=self._dark)
        self.update_scene(view)
        if self._late and (view.page_layout is not None or time.monotonic() > self._latest):
            self._panels += self._late(view)
            self._late = None
        for panel in self._panels:
            panel.update(view)

    def _late_panels(self, send: Send, view: ViewState) -> tuple[Panel, ...]:
        """The panels that the first picture does not wait for: most of the page's elements."""
        gui = self._gui
        panels: list[Panel] = [
            ControlsPanel(gui, send),
            ScenarioFilePanel(gui, send),
            AppearancePanel(gui, view.appearance, send),
            ExportPanel(gui, send),
        ]
        recordings, compare, study, fit = self._tabs
        with recordings:
            panels.append(RecordingsPanel(gui, send))
        with compare:
            panels.append(ComparePanel(gui, send))
        with study:
            panels.append(StudyPanel(gui, send, self._widen_results))
        with fit:
            panels.append(FitPanel(gui, send))
        return tuple(panels)

    def _draw(self, shown: Shown, view: ViewState) -> None:
        """Draws the run at the play head, and the ghost."""
        self._camera.hold(is_held=view.drag is not None)
        pale = view.ghost.drawn if view.ghost is not None else None
        drawn = (shown.ticket, pale, view.appearance)
        if drawn != self._drawn:
            self._drawn = drawn
            layout = self._scene.show(shown.result, pale, view.appearance)
            self._camera.show(layout.boxes(lenses=view.appearance.lenses), layout.plane)
        instant = (self._drawn, view.playback, view.drag)
        has_moved = not all(map(is_, instant, self._instant))
        if has_moved and view.sample is not None and view.playback is not None:
            self._instant = instant
            self._scene.update(view.sample, view.ghost_sample, moving=view.playback.playing)

    def _fit(self) -> None:
        """Sets the widths of all columns; sizes set by the user are kept until then."""
        size = (self._page_layout.width, self._page_layout.height)
        sizes = panel_sizes(*size, lecture=self._is_lecture)
        self._arrange(self._page_layout.arrangement)
        results = sizes.study if self._is_wide else sizes.results
        panels = (self._results, self._gui.main_panel, self._player)
        # viser places a floating panel without its height, until its size changes.
        playback = self._page_layout.playback - self._restored % 2
        widths = (results, sizes.scenario, playback)
        for panel, width, before in zip(panels, widths, self._widths, strict=True):
            if width not in (before, 0):
                panel.set_width(width)
        self._widths = widths

    def _arrange(self, arrangement: Arrangement) -> None:
        """Places the panels; on a phone viser has a sheet for all."""
        if arrangement is self._arrangement:
            return
        # A panel that is moved, or returns from the sheet, loses its width.
        self._arrangement, self._widths = arrangement, (0, 0, 0)
        if arrangement is Arrangement.SHEET:
            return
        self._results.dock_left()
        if arrangement is Arrangement.ONE_COLUMN:
            self._gui.main_panel.dock_below(self._results)
        else:
            self._gui.main_panel.dock_right()
        self._player.float(x=MARGIN, y=-MARGIN)

    def _lay_out_lecture(self) -> None:
        """Collapses the controls for lectures, and expands them for work at a desk."""
        self._fit()
        if self._is_lecture:
            self._gui.main_panel.minimize()
        else:
            self._gui.main_panel.expand()
        sizes = panel_sizes(
            self._page_layout.width, self._page_layout.height, lecture=self._is_lecture
        )
        self._charts.resize(sizes.chart)

    def _widen_results(self, is_wide: bool) -> None:
        """Widens the results for wide content."""
        self._is_wide = is_wide
        self._fit()


def _report(camera: viser.CameraHandle) -> CameraMoved:
    x, y, z = camera.position.tolist()
    return CameraMoved((x, y, z))


def apply_theme(gui: viser.GuiApi, *, dark: bool) -> None:
    """Switches between a light and a dark page; clickable elements have a legible colour."""
    gui.configure_theme(
        show_logo=False,
        show_share_button=False,
        dark_mode=dark,
        brand_color=_DARK_BRAND if dark else _BRIGHT_BRAND,
    )
