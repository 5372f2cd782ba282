"""Initial content of a page: scene, panels, sliders and charts, as messages to the viewer.

The messages are those that the scene and charts of the dashboard send to the viewer, captured from
a server without clients.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.signals import SIGNALS, TraceShape
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import PHASES
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.charts.chart import Chart
from slipgrasp.web.charts.charts import contact_charts, estimate_charts, tracking_charts
from slipgrasp.web.charts.columns import Drawing
from slipgrasp.web.charts.drawn import DrawnChart
from slipgrasp.web.charts.html import Readings, readings_html
from slipgrasp.web.charts.plot import Plot
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.colours import css
from slipgrasp.web.model.events import phases_in
from slipgrasp.web.model.page_layout import MARGIN, WIDEST_SHEET, Picture, panel_sizes
from slipgrasp.web.model.playback import (
    SECONDS_PER_PASS,
    SPEEDS,
    Playback,
    TimeWindow,
    WindowChoice,
    start_playback,
)
from slipgrasp.web.model.sampling import Sample, Sampler, Spot
from slipgrasp.web.model.view import Shown
from slipgrasp.web.panels.playback_panel import caption_html, transport_html
from slipgrasp.web.panels.strip import strip_html
from slipgrasp.web.scene.camera import FIELD_OF_VIEW, frame_box
from slipgrasp.web.scene.close_ups import CLOCK, arrays_of, facts_of
from slipgrasp.web.scene.layout import SceneLayout, reach_and_tick
from slipgrasp.web.scene.scene import Scene
from slipgrasp.web.screen import apply_theme
from slipgrasp.web.standalone.controls import Control
from slipgrasp.web.standalone.kernel_data import encoded, loads_of
from slipgrasp.web.standalone.messages import difference, named, of_panels, sent, templates
from slipgrasp.web.standalone.recorded_scene import Assignment, EverythingMoves, RecordingStage
from slipgrasp.web.standalone.traced import Program, inputs

CHARTS = ("slip", "slip-velocity", "forces", "position-error")
_CHART_HEIGHT = 140
_USUAL = (1440, 900)
_NARROW = 1000
_PUSH, _TRAIL = "/push", "/trail"
_REACHES = np.geomspace(1e-6, 1.0, 1201)  # slips for which the scale of close-ups is listed [m]
# Names of the arrays read by the formulas of the scene: rows with the smallest and the largest slip
# so far, the two adjacent rows, and the weight of the second; the same for the ghost.
_OWN, _PALE = ("l", "m", "a", "b", "w"), ("L", "M", "A", "B", "W")


@dataclass(frozen=True, slots=True)
class Look:
    """Content of a page.

    Attributes:
        data: Plain values for the scripts.
        formulas: JavaScript module of the formulas for moving parts.
    """

    data: dict[str, Any]
    formulas: str


def look_of(result: RunResult, controls: Sequence[Control]) -> Look:
    """Returns the messages for both themes, and the formulas for moving parts.

    Args:
        result: The run that the page shows initially.
        controls: Sliders of the page.
    """
    with _captured(result, controls, dark=True) as capture:
        dark = capture.messages()
    with _captured(result, controls, dark=False) as capture:
        data, formulas = capture.data(), capture.formulas()
    data["dark"] = difference(data["messages"], dark)
    return Look(data, formulas)


@contextmanager
def _captured(result: RunResult, controls: Sequence[Control], *, dark: bool) -> Iterator[Capture]:
    server = ViewerServer()
    try:
        yield Capture(server, result, controls, dark=dark)
    finally:
        server.stop()


class Capture:
    """A server with the content of the page.

    Args:
        server: The server.
        result: The run.
        controls: Sliders.
        dark: Whether the page is dark.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        result: RunResult,
        controls: Sequence[Control],
        *,
        dark: bool,
    ) -> None:
        self._server, self._result, self._dark = server, result, dark
        self._controls = controls
        self._window = TimeWindow(0.0, result.scenario.simulation.duration)
        apply_theme(server.gui, dark=dark)
        self._stage = RecordingStage(server)
        self._scene = Scene(self._stage, detail=EverythingMoves())
        self._layout = self._show_scene()
        self._frame_camera()
        self._add_panels()
        self._messages = sent(server)

    def messages(self) -> list[Any]:
        """Initial messages to the viewer."""
        return named(self._messages, self._messages)

    def data(self) -> dict[str, Any]:
        """All content except formulas, as plain values."""
        program = Program()
        scene = self.scene_data(program)
        self._frame_formula = program.to_javascript(",".join((*_OWN, *_PALE)))
        playback = start_playback(self._result)
        two, one = self._arrangements()
        data = {
            "messages": self._messages,
            "scene": {**scene, "numValues": len(program.outputs), "messages": templates()},
            "html": {name: handle._impl.uuid for name, handle in self._html.items()},
            "controls": self._control_data(),
            "charts": self._chart_data(),
            "closeUps": self._close_up_data(),
            "panels": {
                "two": two,
                "one": one,
                "narrow": _NARROW,
                "sheet": WIDEST_SHEET,
                "margin": MARGIN,
                "width": self._player_width(),
            },
            "camera": [m for m in self._messages if m["type"].startswith("SetCamera")],
            "strip": self._strip(playback),
            "transport": _transports(playback),
            "playback": {
                "time": playback.time,
                "speed": playback.speed,
                "start": playback.window.start,
                "end": playback.window.end,
                "speeds": SPEEDS,
                "secondsPerPass": SECONDS_PER_PASS,
            },
            "colours": {phase.value: css(PHASES[phase]) for phase in ContactPhase},
        }
        return named(data, self._messages)

    def formulas(self) -> str:
        """Module of the formulas; call `data` first."""
        lines = ",".join(f"{key!r}:{formula}" for key, formula in self._line_formulas().items())
        return (
            f"export const frame={self._frame_formula};\n"
            f"export const lines={{{lines}}};\n"
            f"export const camera={self._camera_formula()};\n"
            f"export const closeUps={self._close_up_formula};\n"
        )

    def _show_scene(self) -> SceneLayout:
        """Creates the scene at the start of the run, with the nodes of a ghost."""
        layout = self._scene.show(self._result, self._result, Appearance(dark=self._dark))
        start = Sampler(self._result.trace).at(0.0)
        self._scene.update(start, start)
        return layout

    def _frame_camera(self) -> None:
        camera, layout = self._server.initial_camera, self._layout
        framing = frame_box(*layout.corners(lenses=True), Picture(800, 600), layout.plane)
        camera.fov = FIELD_OF_VIEW
        camera.up = (0.0, 0.0, 1.0)
        camera.position, camera.look_at = framing.position, framing.look_at

    def _add_panels(self) -> None:
        """Adds the panels: results, sliders and playback."""
        gui, html = self._server.gui, {}
        gui.set_panel_label("slipgrasp: move a slider" if self._controls else "slipgrasp")
        self._sliders = [_add_slider(gui, control) for control in self._controls]
        html["check"] = gui.add_html("")
        self._results = gui.add_panel()
        with self._results.add_tab("Run", viser.Icon.CHART_LINE):
            html["card"] = gui.add_html("")
            self._plots = [
                Plot(gui, _CHART_HEIGHT, drawn, dark=self._dark) for drawn in self._drawn()
            ]
            gui.add_html(readings_html(Readings(0.0, {}, ())))
        if len(self._controls) > 1:
            with self._results.add_tab("Map", viser.Icon.LAYOUT_GRID):
                html["map"] = gui.add_html("")
        self._player = gui.add_panel()
        with self._player.add_tab("Playback", viser.Icon.PLAYER_PLAY):
            html["strip"], html["transport"] = gui.add_html(""), gui.add_html("")
        self._results.expand()
        self._player.expand()
        self._html = html

    def _drawn(self) -> list[DrawnChart]:
        trace, none = self._result.trace, frozenset[str]()
        own = [Drawing.of(trace, chart, self._window) for chart in _charts(self._result)]
        return [DrawnChart(each.chart, none, each, each) for each in own]

    def _arrangements(self) -> tuple[list[Any], list[Any]]:
        """Messages that put the panels into two columns, and into one."""
        sizes = panel_sizes(*_USUAL)
        self._results.dock_left()
        self._server.gui.main_panel.dock_right()
        self._player.float(x=MARGIN, y=-MARGIN)
        self._results.set_width(sizes.results)
        self._server.gui.main_panel.set_width(sizes.scenario)
        two = of_panels(sent(self._server))
        self._server.gui.main_panel.dock_below(self._results)
        self._results.set_width(panel_sizes(_NARROW, _USUAL[1]).results)
        return two, of_panels(sent(self._server))

    def _player_width(self) -> Any:
        """Message that sets the width of the playback panel."""
        self._player.set_width(_USUAL[0])
        return next(
            message
            for message in of_panels(sent(self._server))
            if message["uuid"] == self._player._impl.uuid and "width" in message
        )

    def _control_data(self) -> list[dict[str, Any]]:
        return [
            {**control._asdict(), "uuid": slider._impl.uuid}
            for control, slider in zip(self._controls, self._sliders, strict=True)
        ]

    def _chart_data(self) -> list[dict[str, Any]]:
        return [
            {
                "key": chart.key,
                "count": len(chart.lines),
                "lines": [line.key for line in chart.lines],
                "uuid": plot.lines._impl.uuid,
            }
            for chart, plot in zip(_charts(self._result), self._plots, strict=True)
        ]

    def _strip(self, playback: Playback) -> str:
        caption = caption_html(Shown(0, self._result, 0.0), None, 0.0)
        return caption + strip_html(self._result, playback, None)

    def _line_formulas(self) -> dict[str, str]:
        """Functions from a row to the values of the lines, by chart."""
        found = {}
        for chart in _charts(self._traced_result()):
            program = Program()
            places = [program.add(line.values) for line in chart.lines]
            found[chart.key] = program.to_javascript("a", [place for (place,) in places])
        return found

    def _close_up_data(self) -> dict[str, Any]:
        """Common content of close-ups, their scales by the largest slip, and their arrays."""
        scenario, appearance = self._result.scenario, Appearance()
        node = self._scene.object_node
        scales: list[tuple[float, float, float]] = []
        for slip in _REACHES.tolist():
            reach, tick = reach_and_tick(scenario, slip)
            if scales and scales[-1][1] == reach:
                scales.pop()
            scales.append((slip, reach, tick))
        arrays, places, program = self._traced_arrays(), [], Program()
        for name, values in arrays.items():
            found = program.add(values)
            places += found
            arrays[name] = np.array(len(found))
        self._close_up_formula = program.to_javascript("a", places)
        return {
            "facts": facts_of(self._result, self._result, self._layout, appearance, node),
            "held": self._layout.held.ravel().tolist(),
            "scales": scales,
            "arrays": [[name, int(length)] for name, length in arrays.items()],
        }

    def _traced_arrays(self) -> dict[str, NDArray[Any]]:
        """Arrays of close-ups that depend on single rows."""
        known = ("times", "phase", "held")
        arrays = arrays_of(self._traced_result(), None, self._layout)
        return {name: values for name, values in arrays.items() if name not in known}

    def _traced_result(self) -> RunResult:
        """The run with a single row of traced numbers."""
        shape = self._result.trace.shape
        row = inputs("a", shape.num_columns)[None]
        _know(row, shape, ContactPhase.STICK)
        return replace(self._result, trace=Trace.from_rows(shape, row))

    def _camera_formula(self) -> str:
        """Function from width, height and covered height of the view to the camera [m]."""
        width, height, covered = inputs("p", 3)
        low, high = self._layout.corners(lenses=True)
        framing = frame_box(low, high, Picture(width, height, covered), self._layout.plane)
        program = Program()
        places = program.add(np.array([*framing.position, *framing.look_at], dtype=object))
        return program.to_javascript("p", places)

    def scene_data(self, program: Program) -> dict[str, Any]:
        """Assignments to nodes: common ones, by contact and phase, of pushes, of the ghost.

        Args:
            program: Receives the formulas.
        """
        # Also starts with stick, so that each phase differs from the previous one and is drawn.
        phases = [ContactPhase.STICK, *self._slipping(), ContactPhase.STICK]
        by_phase = {phase: self._assignments(phase) for phase in phases}
        drawn = by_phase[ContactPhase.STICK]
        common = [each for each in drawn if each.contact is None and each.node != CLOCK]

        def is_pale(assignment: Assignment) -> bool:
            return assignment.node.startswith(f"{self._scene.ghost_node}/")

        def plain(chosen: Iterable[Assignment]) -> list[dict[str, Any]]:
            return [_plain(each, program) for each in chosen]

        return {
            "ghostRoot": self._scene.ghost_node,
            "ghost": plain(each for each in common if is_pale(each)),
            "common": plain(each for each in common if not is_pale(each)),
            "fingers": [
                {
                    phase.value: plain(each for each in found if each.contact == i)
                    for phase, found in by_phase.items()
                }
                for i in range(len(self._result.scenario.fingers))
            ],
            "pushes": [
                {"end": end, "assignments": plain(self._pushed(load))}
                for end, load in loads_of(self._result.scenario)
            ],
        }

    def _pushed(self, load: Sequence[float]) -> Iterator[Assignment]:
        """Assignments of the arrow of a push; hides it if there is none."""
        with self._stage.recording() as record:
            own = self._instant(ContactPhase.STICK, _OWN, load)
            self._scene.update(own, self._instant(ContactPhase.STICK, _PALE))
            for each in record.assignments.values():
                if _PUSH in each.node:
                    yield each
        if not any(load):
            yield Assignment(self._push_root(), "visible", False)

    def _push_root(self) -> str:
        nodes = (message.get("name", "") for message in self._messages)
        return next(name for name in nodes if name.endswith(_PUSH))

    def _slipping(self) -> list[ContactPhase]:
        """Phases in which a contact slips."""
        phases = phases_in(self._result.scenario)
        return [phase for phase in phases if phase is not ContactPhase.STICK]

    def _assignments(self, phase: ContactPhase) -> list[Assignment]:
        with self._stage.recording() as record:
            self._scene.update(self._instant(phase, _OWN), self._instant(phase, _PALE))
            found = list(record.assignments.values())
        # A path has a variable number of points; close-ups show it.
        has_paths = self._result.trace.shape.space.has_paths
        return [each for each in found if not (has_paths and each.node.endswith(_TRAIL))]

    def _instant(
        self, phase: ContactPhase, names: Sequence[str], load: Sequence[float] | float = 0.0
    ) -> Sample:
        """An instant of any run, with every contact in a phase and a load on the object."""
        shape = self._result.trace.shape
        *rows, weight = names
        traced = np.stack([inputs(name, shape.num_columns) for name in rows])
        _know(traced, shape, phase, load)
        trace = Trace.from_rows(shape, traced)
        # The first two rows are the extremes of all previous rows.
        return Sampler(trace).read(Spot(2, 3, inputs(weight, 1)[0]))


def _charts(result: RunResult) -> list[Chart]:
    """The charts of the page."""
    charts = {chart.key: chart for chart in (*contact_charts(result), *tracking_charts(result))}
    return [*(charts[key] for key in CHARTS), *estimate_charts(result)[:1]]


def _know(
    rows: NDArray[Any], shape: TraceShape, phase: ContactPhase, load: Sequence[float] | float = 0.0
) -> None:
    """Sets the signals that the scene compares: contact phases and the load on the object."""
    start = 0
    for signal in SIGNALS:
        stop = start + shape.widths[signal.per]
        if signal.holds_phases:
            rows[:, start:stop] = float(phase.value)
        elif signal.name == "external_wrench":
            rows[:, start:stop] = load
        elif signal.name == "slip_path":
            rows[:, start:stop] = 0.0
        start = stop


def _plain(assignment: Assignment, program: Program) -> dict[str, Any]:
    """An assignment as plain values: indices of numbers in the results, or the value."""
    told = {"node": assignment.node, "key": assignment.key}
    if assignment.moves:
        return {**told, "places": program.add(assignment.value)}
    value = assignment.value
    return {**told, "value": encoded(value) if isinstance(value, np.ndarray) else value}


def _add_slider(gui: viser.GuiApi, control: Control) -> viser.GuiInputHandle[float]:
    return gui.add_slider(
        control.label,
        min=control.low,
        max=control.high,
        step=control.step,
        initial_value=control.value,
        hint=control.text,
    )


def _transports(playback: Playback) -> dict[str, str]:
    """HTML of the playback controls, by playback state and time range."""
    heads = (replace(playback, playing=playing, pace=None) for playing in (True, False))
    return {
        f"{str(head.playing).lower()} {choice.value}": transport_html(head, choice, is_alone=True)
        for head in heads
        for choice in (WindowChoice.WHOLE, WindowChoice.CLOSER)
    }
