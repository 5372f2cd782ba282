"""What a page shows before it moves: scene, panels, sliders and charts, as messages to the viewer.

They are those that the dashboard's own scene and charts send to the viewer, taken from a server
that nobody connects to.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray
from viser import _messages

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.signals import SIGNALS, TraceShape
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import PHASES
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.charts.charts import Chart, contact_charts, estimate_charts, tracking_charts
from slipgrasp.web.charts.columns import Drawing
from slipgrasp.web.charts.drawn import DrawnChart
from slipgrasp.web.charts.html import Readings, readings_html
from slipgrasp.web.charts.plot import Plot
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.colours import css
from slipgrasp.web.model.events import phases_in
from slipgrasp.web.model.intents.playback import ChooseWindow, Zoom
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
from slipgrasp.web.panels.playback_panel import caption_html, moves_html, window_button
from slipgrasp.web.panels.strip import strip_html
from slipgrasp.web.scene.camera import FIELD_OF_VIEW, frame_box
from slipgrasp.web.scene.close_ups import CLOCK, PACKET, arrays_of, facts_of
from slipgrasp.web.scene.layout import SceneLayout, reach_and_tick
from slipgrasp.web.scene.scene import Scene
from slipgrasp.web.screen import apply_theme
from slipgrasp.web.standalone.controls import Control
from slipgrasp.web.standalone.kernel_data import encoded, loads_of
from slipgrasp.web.standalone.recorded_scene import Assignment, EverythingMoves, RecordingStage
from slipgrasp.web.standalone.traced import Program, inputs

CHARTS = ("slip", "slip-velocity", "forces", "position-error")
_CHART_HEIGHT = 140
_USUAL = (1440, 900)
_NARROW = 1000
_PUSH, _TRAIL = "/push", "/trail"
_REACHES = np.geomspace(1e-6, 1.0, 1201)  # slips for which the scale of close-ups is listed [m]
_HELP = (
    '<span class="sg-group"><button type="button" data-sg-help aria-label="Keys" '
    'title="All keys (?)">?</button></span>'
)
_UUID = re.compile(r"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}")
_RUN_ID = re.compile(r'"run_id":"[0-9a-f]+"')
# Names of the arrays that the formulas of the scene read: rows with the least and the largest slip
# so far, the rows on both sides, and the weight of the second; likewise of the ghost.
_OWN, _PALE = ("l", "m", "a", "b", "w"), ("L", "M", "A", "B", "W")


@dataclass(frozen=True, slots=True)
class Look:
    """What a page shows.

    Attributes:
        data: Plain values for the scripts.
        formulas: The module of JavaScript by which things move.
    """

    data: dict[str, Any]
    formulas: str


def look_of(result: RunResult, controls: Sequence[Control]) -> Look:
    """The messages in both themes, and how what they show moves.

    Args:
        result: The run that the page shows first.
        controls: Its sliders.
    """
    with _captured(result, controls, dark=True) as capture:
        dark = capture.messages()
    with _captured(result, controls, dark=False) as capture:
        data, formulas = capture.data(), capture.formulas()
    data["dark"] = _difference(data["messages"], dark)
    return Look(data, formulas)


@contextmanager
def _captured(result: RunResult, controls: Sequence[Control], *, dark: bool) -> Iterator[Capture]:
    server = ViewerServer()
    try:
        yield Capture(server, result, controls, dark=dark)
    finally:
        server.stop()


class Capture:
    """A server with everything that the page shows.

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
        self._messages = _sent(server)

    def messages(self) -> list[Any]:
        """First messages to the viewer."""
        return _named(self._messages, self._messages)

    def data(self) -> dict[str, Any]:
        """Everything that is no formula, as plain values."""
        program = Program()
        scene = self.scene_data(program)
        self._frame_formula = program.to_javascript(",".join((*_OWN, *_PALE)))
        playback = start_playback(self._result)
        two, one = self._arrangements()
        data = {
            "messages": self._messages,
            "scene": {**scene, "numValues": len(program.outputs), "messages": _templates()},
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
        return _named(data, self._messages)

    def formulas(self) -> str:
        """The module of the formulas; after `data`."""
        lines = ",".join(f"{key!r}:{formula}" for key, formula in self._line_formulas().items())
        return (
            f"export const frame={self._frame_formula};\n"
            f"export const lines={{{lines}}};\n"
            f"export const camera={self._camera_formula()};\n"
            f"export const closeUps={self._close_up_formula};\n"
        )

    def _show_scene(self) -> SceneLayout:
        """The scene at the start of the run, with the nodes of a ghost."""
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
        """Results to the left, sliders to the right, the play head below."""
        gui, html = self._server.gui, {}
        gui.set_panel_label("slipgrasp")
        self._sliders = [_add_slider(gui, control) for control in self._controls]
        html["check"] = gui.add_html("")
        self._results = gui.add_panel()
        with self._results.add_tab("Run", viser.Icon.CHART_LINE):
            html["card"] = gui.add_html("")
            self._plots = [
                Plot(gui, _CHART_HEIGHT, drawn, dark=self._dark) for drawn in self._drawn()
            ]
            gui.add_html(readings_html(Readings({}, ())))
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
        two = _of_panels(_sent(self._server))
        self._server.gui.main_panel.dock_below(self._results)
        self._results.set_width(panel_sizes(_NARROW, _USUAL[1]).results)
        return two, _of_panels(_sent(self._server))

    def _player_width(self) -> Any:
        """The message that gives the play head's panel a width."""
        self._player.set_width(_USUAL[0])
        return next(
            message
            for message in _of_panels(_sent(self._server))
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
        """Per chart a function from a row to the values of its lines."""
        found = {}
        for chart in _charts(self._traced_result()):
            program = Program()
            places = [program.add(line.values) for line in chart.lines]
            found[chart.key] = program.to_javascript("a", [place for (place,) in places])
        return found

    def _close_up_data(self) -> dict[str, Any]:
        """What close-ups show of every run, their scales by the largest slip, and their arrays."""
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
        """Arrays of close-ups whose numbers follow from each row alone."""
        known = ("times", "phase", "held")
        arrays = arrays_of(self._traced_result(), None, self._layout)
        return {name: values for name, values in arrays.items() if name not in known}

    def _traced_result(self) -> RunResult:
        """The run with a single row, which is not known."""
        shape = self._result.trace.shape
        row = inputs("a", shape.num_columns)[None]
        _know(row, shape, ContactPhase.STICK)
        return replace(self._result, trace=Trace.from_rows(shape, row))

    def _camera_formula(self) -> str:
        """A function from width, height and covered height of a picture to the camera [m]."""
        width, height, covered = inputs("p", 3)
        low, high = self._layout.corners(lenses=True)
        framing = frame_box(low, high, Picture(width, height, covered), self._layout.plane)
        program = Program()
        places = program.add(np.array([*framing.position, *framing.look_at], dtype=object))
        return program.to_javascript("p", places)

    def scene_data(self, program: Program) -> dict[str, Any]:
        """Assignments to nodes: of all, of each contact by its phase, of pushes, of the ghost.

        Args:
            program: Gets the formulas.
        """
        # Sticking first, too: each phase then differs from the one before, and is drawn anew.
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
        """The arrow of a push, or that there is none."""
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
        """The phases of a contact that slips."""
        phases = phases_in(self._result.scenario)
        return [phase for phase in phases if phase is not ContactPhase.STICK]

    def _assignments(self, phase: ContactPhase) -> list[Assignment]:
        with self._stage.recording() as record:
            self._scene.update(self._instant(phase, _OWN), self._instant(phase, _PALE))
            found = list(record.assignments.values())
        # A path has as many points as it needs; the close-ups show it.
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
        # The first rows hold the extremes of all rows before.
        return Sampler(trace).read(Spot(2, 3, inputs(weight, 1)[0]))


def _charts(result: RunResult) -> list[Chart]:
    """The charts of the page."""
    charts = {chart.key: chart for chart in (*contact_charts(result), *tracking_charts(result))}
    return [*(charts[key] for key in CHARTS), *estimate_charts(result)[:1]]


def _know(
    rows: NDArray[Any], shape: TraceShape, phase: ContactPhase, load: Sequence[float] | float = 0.0
) -> None:
    """Sets what the scene compares: phases of the contacts, and what pushes the object."""
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
    """An assignment as plain values: places of numbers among the results, or the value."""
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
    """The controls of the play head, by whether it moves and which time range is shown."""
    return {
        f"{str(playing).lower()} {choice.value}": _transport(playback, choice, playing=playing)
        for playing in (True, False)
        for choice in (WindowChoice.WHOLE, WindowChoice.CLOSER)
    }


def _transport(playback: Playback, choice: WindowChoice, *, playing: bool) -> str:
    whole, head = ChooseWindow(WindowChoice.WHOLE), replace(playback, playing=playing, pace=None)
    windows = "".join(
        (
            window_button("whole run", choice is WindowChoice.WHOLE, whole),
            window_button("closer", choice is WindowChoice.CLOSER, Zoom()),
        )
    )
    return (
        f'<div class="sg-transport">{moves_html(head, with_pace=False)}'
        f'<span class="sg-group">{windows}</span>{_HELP}</div>'
    )


def _sent(server: viser.ViserServer) -> list[Any]:
    """What a viewer that connects now is sent, as plain values; charts without their lines."""
    buffer = server._websock_server._broadcast_buffer
    messages = []
    for message in list(buffer.message_from_id.values()):
        arrays: list[memoryview] = []
        plain = message.as_serializable_dict(arrays)
        # The page itself computes what close-ups show.
        if plain.get("name") not in (PACKET, CLOCK):
            messages.append(_with_arrays(plain, arrays))
    return _ordered(messages)


def _ordered(messages: list[Any]) -> list[Any]:
    """Messages whose elements are numbered from 0; viser counts those of all servers."""
    elements = [m["props"] for m in messages if "order" in m.get("props", ())]
    ranks = {order: k for k, order in enumerate(sorted(each["order"] for each in elements))}
    for each in elements:
        each["order"] = ranks[each["order"]]
    return messages


def _with_arrays(value: Any, arrays: Sequence[memoryview]) -> Any:
    """Plain values with arrays in place of references to them."""
    if isinstance(value, dict):
        if "__binary_index" in value:
            array = np.frombuffer(arrays[value["__binary_index"]], value["dtype"])
            return encoded(array)
        return {
            key: _empty(inner) if key == "data" else _with_arrays(inner, arrays)
            for key, inner in value.items()
        }
    if isinstance(value, bytes | memoryview):
        return encoded(np.frombuffer(value, np.uint8))
    if isinstance(value, list | tuple):
        return [_with_arrays(each, arrays) for each in value]
    return value


def _empty(columns: Any) -> Any:
    """Columns of a chart without their values."""
    return [encoded(np.empty(0)) for _ in columns]


def _of_panels(messages: Sequence[Any]) -> list[Any]:
    return [message for message in messages if message["type"].startswith("GuiSetPanel")]


def _templates() -> dict[str, Any]:
    """Per property of a node the message that sets it, and its field with the value."""
    name, none = "", (0.0, 0.0, 0.0)
    made = {
        "position": ("position", _messages.SetPositionMessage(name, none)),
        "wxyz": ("wxyz", _messages.SetOrientationMessage(name, (1.0, *none))),
        "visible": ("visible", _messages.SetSceneNodeVisibilityMessage(name, True)),
        "updates": ("updates", _messages.SceneNodeUpdateMessage(name, {})),
    }
    return {
        key: {"field": field, "message": message.as_serializable_dict([])}
        for key, (field, message) in made.items()
    }


def _difference(first: Any, second: Any) -> Any:
    """What must replace parts of plain values: by key or place, None where nothing does."""
    if isinstance(first, list) and isinstance(second, list) and len(first) == len(second):
        first, second = dict(enumerate(first)), dict(enumerate(second))
    if not (isinstance(first, dict) and isinstance(second, dict)) or first.keys() != second.keys():
        return None if first == second else {"": second}
    found = {str(key): _difference(inner, second[key]) for key, inner in first.items()}
    return {key: inner for key, inner in found.items() if inner is not None} or None


def _named(value: Any, messages: Sequence[Any]) -> Any:
    """Plain values with names in place of random ones, so that a page has the same bytes again."""
    names: dict[str, str] = {}
    for found in _UUID.findall(json.dumps(messages)):
        names.setdefault(found, f"sg-{len(names)}")
    text = json.dumps(value, separators=(",", ":"))
    text = _UUID.sub(lambda found: names.get(found[0], found[0]), text)
    return json.loads(_RUN_ID.sub('"run_id":"page"', text))
