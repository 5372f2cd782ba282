"""Everything one user sees: the scene and the panels, drawn from one view."""

from __future__ import annotations

from typing import NamedTuple

import viser

from web.camera import FrontCamera
from web.intents.intent import Send
from web.intents.picture import CameraMoved
from web.panels.charts_panel import ChartsPanel
from web.panels.outcome_panel import OutcomePanel
from web.panels.playback_panel import PlaybackPanel
from web.panels.recordings_panel import RecordingsPanel
from web.panels.scenario_panel import ScenarioPanel
from web.scene.scene import Scene
from web.view import ViewState

__all__ = ["PanelSizes", "Screen", "panel_sizes"]

_PLAYBACK_HEIGHT = 232
_PLAYBACK_HEIGHT_PER_CONTACT = 17


class PanelSizes(NamedTuple):
    """Widths of the columns, of the playback panel, and height of a chart [px]."""

    results: int
    scenario: int
    playback: int
    chart: int


def panel_sizes(width: int, height: int) -> PanelSizes:
    """Sizes that leave the scene its share of a browser window [px]."""
    results = min(max(round(0.27 * width), 270), 400)
    scenario = min(max(round(0.22 * width), 250), 320)
    playback = max(width - results - scenario - 60, 240)
    chart = min(max((height - 340) // 3 - 48, 130), 190)
    return PanelSizes(results, scenario, min(playback, 620), chart)


class Screen:
    """Owns every node and panel of one viewer.

    Args:
        client: The viewer; what it sees is its own.
        camera: Its camera.
        view: What it shows first.
        send: Takes the intents of its user.
    """

    def __init__(
        self, client: viser.ClientHandle, camera: FrontCamera, view: ViewState, send: Send
    ) -> None:
        gui = client.gui
        sizes = panel_sizes(client.camera.image_width, client.camera.image_height)
        self._scene = Scene(client)
        self._camera = camera
        gui.main_panel.dock_right()
        gui.main_panel.set_width(sizes.scenario)
        self._scenario = ScenarioPanel(gui, view.draft, send)
        self._results = gui.add_panel()
        with self._results.add_tab("Run", viser.Icon.CHART_LINE):
            self._outcome = OutcomePanel(gui)
            self._charts = ChartsPanel(client, sizes.chart)
        with self._results.add_tab("Recordings", viser.Icon.LIST):
            self._recordings = RecordingsPanel(gui, send)
        self._results.dock_left()
        self._results.set_width(sizes.results)
        self._controls = gui.add_panel()
        with self._controls.add_tab("Playback", viser.Icon.PLAYER_PLAY):
            self._playback = PlaybackPanel(gui, send)
        self._controls.float(x=30.0, y=-12.0, width=sizes.playback)
        self._panels = (
            self._scenario,
            self._outcome,
            self._recordings,
            self._playback,
            self._charts,
        )
        self._ticket = 0
        client.camera.on_update(lambda camera: send(_report(camera)))

    def update(self, view: ViewState) -> None:
        """Draws a view; whatever did not change costs nothing."""
        if view.shown is not None and view.shown.ticket != self._ticket:
            layout = self._scene.show(view.shown.result)
            contacts = len(view.shown.result.scenario.fingers)
            covered = _PLAYBACK_HEIGHT + contacts * _PLAYBACK_HEIGHT_PER_CONTACT
            self._camera.show(layout.low, layout.high, covered)
            self._ticket = view.shown.ticket
        if view.sample is not None:
            self._scene.update(view.sample)
        for panel in self._panels:
            panel.update(view)

    def remove(self) -> None:
        """Takes everything off the page."""
        for panel in self._panels:
            panel.remove()
        self._results.remove()
        self._controls.remove()
        self._scene.remove()


def _report(camera: viser.CameraHandle) -> CameraMoved:
    x, y, z = camera.position.tolist()
    return CameraMoved((x, y, z), camera.image_width, camera.image_height)
