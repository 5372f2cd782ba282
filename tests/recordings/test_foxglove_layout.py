"""The layout for Foxglove shows what a recording holds, with settings that Foxglove knows."""

import json
import re
from importlib import resources

import pytest
from foxglove import layouts

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings import palette
from slipgrasp.recordings.file.foxglove.layouts import SCENE_TOPIC
from slipgrasp.recordings.file.writer import write_recording
from tests.recordings.reading_display import read_topic

LAYOUT = json.loads(
    resources.files("slipgrasp.recordings.file.foxglove").joinpath("layout.json").read_text()
)
PANELS = LAYOUT["configById"]
SERIES = [series for panel in PANELS.values() for series in panel.get("paths", [])]
PATH = re.compile(r"(/[\w/]+)\.(\w+)\[(\d)\]")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The first message of any topic of the paper's two cases, decoded."""
    folder = tmp_path_factory.mktemp("recordings")
    for case in ("paper-case-1", "paper-case-2"):
        scenario = with_values(load_scenario(case), {"simulation.duration": 0.01})
        write_recording(simulate(scenario), folder / f"{case}.mcap")

    def first(topic):
        for case in ("paper-case-1", "paper-case-2"):
            *_, message = read_topic(folder / f"{case}.mcap", topic)[0]
            yield message

    return first


def hexadecimal(colour):
    return "#{:02x}{:02x}{:02x}".format(*colour)


def snake(name):
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()


def settings(mapping, *without):
    """A part of the layout as arguments of the SDK's classes, which refuse unknown ones."""
    return {snake(key): value for key, value in mapping.items() if key not in without}


def panels_in(tree):
    if isinstance(tree, str):
        return [tree]
    assert set(tree) == {"direction", "first", "second", "splitPercentage"}
    return panels_in(tree["first"]) + panels_in(tree["second"])


@pytest.mark.parametrize("path", sorted({series["value"] for series in SERIES}))
def test_every_path_leads_to_a_number_of_a_recording(recorded, path):
    found = PATH.fullmatch(path)
    assert found
    topic, field, index = found[1], found[2], int(found[3])
    lengths = []
    for message in recorded(topic):
        values = getattr(message, field)
        assert isinstance(values[0], int | float)
        lengths.append(len(values))
    assert index < max(lengths)
    if field not in ("estimates", "true_parameters"):
        assert index < min(lengths)


def test_every_panel_has_one_place():
    assert sorted(panels_in(LAYOUT["layout"])) == sorted(PANELS)
    parts = {"configById", "globalVariables", "userNodes", "playbackConfig", "layout"}
    assert set(LAYOUT) == parts


def test_the_scene_is_seen_from_the_front_of_its_plane(recorded):
    panel = PANELS["3D!hand"]
    for scene in recorded(SCENE_TOPIC):
        assert len(scene.entities) > 0
    assert list(panel["topics"]) == [SCENE_TOPIC]
    for message in recorded("/tf"):
        assert panel["followTf"] in {t.child_frame_id for t in message.transforms}
        (pose,) = (t for t in message.transforms if t.child_frame_id == "object")
        x, y, _ = panel["cameraState"]["targetOffset"]
        assert abs(pose.translation.x - x) + abs(pose.translation.y - y) < 0.1
    assert panel["cameraState"]["phi"] == panel["cameraState"]["thetaOffset"] == 0


def test_phases_and_fingers_have_the_colours_of_the_palette():
    for series in PANELS["StateTransitions!phases"]["paths"]:
        states = {state["value"]: state for state in series["customStates"]["states"]}
        assert set(states) == {str(int(phase)) for phase in ContactPhase}
        for phase in ContactPhase:
            assert states[str(int(phase))]["color"] == hexadecimal(palette.PHASES[phase])
            assert states[str(int(phase))]["label"] == phase.label.replace("_", " ")
    fingers = [hexadecimal(colour) for colour in palette.FINGERS]
    for name, panel in PANELS.items():
        if name.startswith("Plot!"):
            for series in panel["paths"]:
                index = int(PATH.fullmatch(series["value"])[3])
                finger = index // 2 if name == "Plot!torque" else index
                assert series["color"] == fingers[finger]


def known_to_foxglove(kind, panel):
    """Makes the SDK's own objects of a panel; a setting that they do not know is an error."""
    own = settings(panel, "foxglovePanelTitle")
    if kind == "3D":
        layouts.BaseRendererTransforms(**settings(panel["scene"]["transforms"]))
        layouts.BaseRendererSceneSettings(**settings(panel["scene"]))
        layouts.ThreeDeeCameraState(**settings(panel["cameraState"]))
        return layouts.ThreeDeeConfig(**own)
    if kind == "Plot":
        for series in panel["paths"]:
            layouts.PlotSeries(**settings(series))
        return layouts.PlotConfig(**own)
    for series in panel["paths"]:
        layouts.StateTransitionsSeries(**settings(series))
        for state in series["customStates"]["states"]:
            layouts.StateTransitionsDiscreteCustomState(**state)
    return layouts.StateTransitionsConfig(**own)


@pytest.mark.parametrize("name", list(PANELS))
def test_foxglove_s_own_library_knows_every_setting(name):
    kind, _, _ = name.partition("!")
    config = known_to_foxglove(kind, PANELS[name])
    assert type(config).__name__ == {"3D": "ThreeDee"}.get(kind, kind) + "Config"
