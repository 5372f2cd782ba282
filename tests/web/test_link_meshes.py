"""A hand with meshes: they are sent once, follow their links, and no file of them is named."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image
from playwright.sync_api import Browser

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.chain import rotation_of
from slipgrasp.core.scenario.hand_files.meshes import HandMeshes, Mesh
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.palette import PHASES
from slipgrasp.scene import skeleton
from slipgrasp.scene.states import states_at
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.app import create_dashboard_app
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.given_hand import GivenHand
from slipgrasp.web.model.sampling import Sampler
from slipgrasp.web.model.surfaces import surfaces_for
from slipgrasp.web.scene.scene import Scene
from tests.server.serving import patient_settings, serve
from tests.waiting import wait_until
from tests.web.conftest import visitors_of
from tests.web.test_scene_nodes import counting, node

LATER = 0.02
LINK = "/links-1/finger_0-base/finger_0-link_0/finger_0-link_1"
UNTURNED = (1.0, 0.0, 0.0, 0.0)
PAINT = (210, 20, 200)


def box(x: float, y: float, z: float) -> Mesh:
    shape = trimesh.creation.box((x, y, z))
    return Mesh(shape.vertices.astype(np.float32), shape.faces.astype(np.uint32))


def trifinger() -> SpatialScenario:
    """The preset with fingers as from a file: of one base, with first joints that are turned."""
    scenario = with_values(load_scenario("trifinger"), {"simulation.duration": 2.0 * LATER})
    assert isinstance(scenario, SpatialScenario)
    fingers = []
    for finger in scenario.fingers:
        first, *rest = finger.joints
        assert first.place == (0.0, 0.0, 0.0) and first.attitude == UNTURNED
        joints = (replace(first, attitude=finger.attitude), *rest)
        fingers.append(replace(finger, attitude=UNTURNED, joints=joints))
    return replace(scenario, fingers=tuple(fingers))


def meshes_for(scenario: SpatialScenario) -> HandMeshes:
    """A plate that everyone sees as the holder, and a bar along every link."""
    bars = (box(0.03, 0.05, 0.03), box(0.03, 0.03, 0.16), box(0.02, 0.02, 0.16))
    chains = [(finger.joints, finger.tip) for finger in scenario.fingers]
    return HandMeshes.of(chains, box(0.3, 0.01, 0.8), [bars] * len(chains))


@pytest.fixture(scope="module")
def run() -> RunResult:
    return simulate(trifinger())


@pytest.fixture
def scene(viewer_server: ViewerServer) -> Scene:
    return Scene(viewer_server, meshes=meshes_for(trifinger()))


def world_place(server: ViewerServer, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Pose of a node, composed from those of all nodes that contain it."""
    origin, turn = np.zeros(3), np.eye(3)
    parts = name.strip("/").split("/")
    for k in range(1, len(parts) + 1):
        each = node(server, "/" + "/".join(parts[:k]))
        origin = origin + turn @ each.position
        turn = turn @ rotation_of(each.wxyz.tolist())
    return origin, turn


def test_meshes_are_at_their_links_and_replace_their_bars(
    scene: Scene, viewer_server: ViewerServer, run: RunResult
) -> None:
    scene.show(run)
    for time in (0.0, LATER):
        scene.update(Sampler(run.trace).at(time))
        states = states_at(run.trace, np.array([time]))
        poses = skeleton.world_poses(skeleton.frames_of(run.scenario), states)
        origin, turn = poses[skeleton.link_frame(0, 1)]
        found, turned = world_place(viewer_server, f"{LINK}/mesh")
        np.testing.assert_allclose(found, origin[0], atol=1e-12)
        np.testing.assert_allclose(turned, turn[0], atol=1e-12)
    assert node(viewer_server, "/links-1/finger_0-base/mesh").vertices.shape == (8, 3)
    names = viewer_server.scene._handle_from_node_name
    (root,) = (name for name in names if name.startswith("/space") and name.count("/") == 1)
    assert not [name for name in names if name.startswith(f"{root}/finger")]
    assert tuple(node(viewer_server, f"{root}/object/contact0/tip/ball").color) in PHASES.values()
    # The last link may contain the mark of its fingertip.
    assert node(viewer_server, f"{LINK}/mesh").opacity is None
    assert node(viewer_server, f"{LINK}/finger_0-link_2/mesh").opacity == 0.4


def test_meshes_are_sent_once_and_hidden_for_other_hands(
    scene: Scene, viewer_server: ViewerServer, run: RunResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    other = simulate(with_values(load_scenario("spatial-prism"), {"simulation.duration": LATER}))
    values: dict[str, Any] = {"object.mass": 0.1, "fingers.0.joints.1.mass": 0.2}
    values |= {"fingers.0.contact_offset.1": 0.001, "fingers.1.friction": 0.4}
    changed = simulate(with_values(trifinger(), values))
    with counting(monkeypatch) as sent:
        scene.show(run)
    assert len(meshes_in(sent)) == 10
    mesh = node(viewer_server, f"{LINK}/mesh")
    with counting(monkeypatch) as sent:
        for each, is_shown in ((changed, True), (other, False), (run, True)):
            scene.show(each)
            scene.update(Sampler(each.trace).at(0.01))
            assert node(viewer_server, "/links-1").visible is is_shown
        scene.show(run, appearance=Appearance(dark=True))
    assert node(viewer_server, f"{LINK}/mesh") is mesh
    assert meshes_in(sent) == []
    assert tuple(mesh.color) == surfaces_for(dark=True).link
    assert tuple(node(viewer_server, "/links-1/finger_0-base/mesh").color) == (
        surfaces_for(dark=True).mount
    )


def meshes_in(sent: list[Any]) -> list[Any]:
    kinds = [(type(message).__name__, getattr(message, "name", "")) for message in sent]
    return [each for each in kinds if each[0] == "MeshMessage" and "/links" in each[1]]


def test_a_hand_that_is_moved_as_a_whole_keeps_its_base_and_one_that_is_not_loses_it(
    scene: Scene, viewer_server: ViewerServer, run: RunResult
) -> None:
    assert isinstance(run.scenario, SpatialScenario)
    fingers = [
        replace(finger, base=(finger.base[0] + 0.001, *finger.base[1:]))
        for finger in run.scenario.fingers
    ]
    for number, moved, has_base in (
        (1, tuple(fingers), True),
        (2, (fingers[0], *run.scenario.fingers[1:]), False),
    ):
        scene.show(replace(run, scenario=replace(run.scenario, fingers=moved)))
        place, _ = world_place(viewer_server, f"/links-{number}/finger_0-base")
        np.testing.assert_allclose(place, fingers[0].base)
        base = viewer_server.scene.get_handle_by_name(f"/links-{number}/finger_0-base/mesh")
        assert (base is not None) is has_base


@pytest.mark.browser
def test_a_page_opens_with_the_hand_and_its_recording_names_no_file(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Only the holder has this colour.
    painted = surfaces_for(dark=False)._replace(mount=PAINT)
    monkeypatch.setattr("slipgrasp.web.scene.scene.surfaces_for", lambda *, dark: painted)
    scenario, settings = trifinger(), patient_settings(tmp_path)
    hand = GivenHand(Draft.starting_from("file hand.toml", scenario), meshes_for(scenario))
    app = create_dashboard_app(settings, hand=hand)
    with serve(settings, app) as server, visitors_of(browser, server) as visitors:
        page = visitors.open()
        page.get_by_text("Saved as").wait_for()
        wait_until(lambda: shows(page.screenshot(), PAINT), "no mesh is drawn")
        with server.client() as client:
            (listed,) = client.get("/runs").json()["data"]
            stored = client.get(f"/runs/{listed['id']}").json()
    recording = tmp_path / f"{listed['id']}.mcap"
    assert read_recording(recording).scenario == scenario
    assert "hand.toml" not in f"{listed} {stored}"
    assert b"hand.toml" not in recording.read_bytes()


def shows(screenshot: bytes, colour: tuple[int, int, int]) -> bool:
    """Whether some of a picture has the hue of a colour, in any light."""

    pixels = np.asarray(Image.open(io.BytesIO(screenshot)).convert("RGB"), float)
    hue = pixels / np.maximum(np.linalg.norm(pixels, axis=2, keepdims=True), 1.0)
    wanted = np.array(colour) / np.linalg.norm(colour)
    return bool((hue @ wanted > 0.99).sum() > 200)
