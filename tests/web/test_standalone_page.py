"""The page that simulates: its formulas are those of the dashboard, and its file is complete."""

import dataclasses
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest
import viser
from viser import _messages

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.verdict import headline_of
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.words.endings import end_words
from slipgrasp.server.viewer.client_page import PackingError, packed_page, unpack_page
from slipgrasp.server.viewer.server import ViewerServer
from slipgrasp.web.charts.charts import contact_charts, estimate_charts, tracking_charts
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.sampling import Sampler, locate
from slipgrasp.web.scene.close_ups import arrays_of
from slipgrasp.web.scene.layout import lay_out, reach_and_tick
from slipgrasp.web.scene.scene import Scene
from slipgrasp.web.standalone.controls import ControlError, controls_of, usual_controls
from slipgrasp.web.standalone.kernel_data import PageError, loads_of, run_data
from slipgrasp.web.standalone.look import CHARTS, Capture, look_of
from slipgrasp.web.standalone.packing import pack, unpack
from slipgrasp.web.standalone.page_file import write_page
from slipgrasp.web.standalone.recorded_scene import EverythingMoves, RecordingStage
from slipgrasp.web.standalone.traced import Program
from tests.web.test_traced import evaluated

pytestmark = pytest.mark.slow

MOST_BYTES = 1.4e6
COMMAND = "slipgrasp run paper-case-1"
SHARES = (0.0, 0.003, 0.0085, 0.012, 0.3, 1.0)


def short(name, **values):
    return with_values(load_scenario(name), {"simulation.duration": 0.5, **values})


SCENARIOS = {
    "sides of a box": load_scenario("paper-case-1"),
    "friction unknown": short("paper-case-2"),
    "three fingers": short("three-fingers"),
    "push": short(
        "composite-case-2",
        **{"pulses.0.time": 0.2, "pulses.0.duration": 0.1, "pulses.0.force": [0.0, -15.0]},
    ),
    "motion of pieces": short("shake-test"),
    "spatial hand": short("spatial-prism"),
    "jaws": short("parallel-gripper"),
    "round object that is turned": with_values(
        load_scenario("spatial-bottle"), {"simulation.duration": 1.2}
    ),
}


def row_of(result, row, extremes):
    """A row of a run; of its slips the least or the largest so far instead."""
    rows = result.trace.to_rows()
    found = rows[row].copy()
    start, width = run_data(result)["columns"]["slip"]
    found[start : start + width] = extremes(rows[: row + 1, start : start + width], axis=0)
    return found


def read_at(result, time, names):
    """What the formulas of the scene read at a time."""
    spot = locate(result.trace.times, time)
    rows = result.trace.to_rows()
    least, largest = (row_of(result, spot.row, extremes) for extremes in (np.min, np.max))
    return dict(
        zip(names, (least, largest, rows[spot.row], rows[spot.following]), strict=False)
    ) | {names[-1]: [spot.weight]}


def recorded(scene, stage, sampler, time):
    """What the dashboard's scene sets at a time, by node and property."""
    with stage.recording() as record:
        scene.update(sampler.at(time), sampler.at(time))
        return dict(record.assignments)


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_formulas_give_what_the_scene_of_the_dashboard_draws(name):
    result = simulate(SCENARIOS[name])
    server = ViewerServer()
    try:
        program = Program()
        scene_data = Capture(server, result, (), dark=False).scene_data(program)
        stage = RecordingStage(server)
        scene = Scene(stage, detail=EverythingMoves())
        scene.show(result, result, Appearance(lenses=False))
        sampler, drawn = Sampler(result.trace), {}
        for share in SHARES:
            time = share * result.end_time
            drawn |= recorded(scene, stage, sampler, time)
            check_instant(result, program, scene_data, drawn, time)
    finally:
        server.stop()


def check_instant(result, program, scene_data, drawn, time):
    names = {**read_at(result, time, "lmabw"), **read_at(result, time, "LMABW")}
    values = evaluated(program, **names)
    phases = Sampler(result.trace).at(time).states.phases[0]
    chosen = [*scene_data["common"], *scene_data["ghost"]]
    chosen += [each for i, p in enumerate(phases) for each in scene_data["fingers"][i][int(p)]]
    moving = [each for each in chosen if "places" in each]
    assert len(moving) > 15
    for each in moving:
        wanted = np.ravel(drawn[each["node"], each["key"]].value)
        if each["key"] == "wxyz":
            # Both signs of a quaternion are one rotation.
            wanted = wanted * np.sign(wanted @ values[each["places"]])
        # The dashboard draws cones anew only where an eye sees the difference.
        allowed = 2e-3 if "/cone/" in each["node"] else 1e-6
        found = values[each["places"]]
        assert found == pytest.approx(wanted, rel=1e-6, abs=allowed), (time, each["node"])


def test_close_ups_have_the_arrays_of_the_dashboard():
    result = simulate(short("paper-case-2"))
    look = look_of(result, ())
    told = look.data["closeUps"]
    arrays = arrays_of(result, None, lay_out(result))
    assert {name for name, _ in told["arrays"]} == set(arrays) - {"times", "phase", "held"}
    for name, length in told["arrays"]:
        assert arrays[name][0].size == length, name
    assert told["held"] == pytest.approx(arrays["held"].ravel())
    largest = float(np.abs(result.trace.slip).max())
    scale = next(scale for scale in told["scales"] if scale[0] >= largest)
    assert tuple(scale[1:]) == reach_and_tick(result.scenario, largest)


def test_charts_show_the_lines_of_the_dashboard():
    result = simulate(short("paper-case-2"))
    charts = {c.key: c for c in (*contact_charts(result), *tracking_charts(result))}
    look = look_of(result, ())
    charts |= {chart.key: chart for chart in estimate_charts(result)}
    for key, told in zip((*CHARTS, "estimates-friction"), look.data["charts"], strict=True):
        assert told["key"] == key
        assert told["lines"] == [line.key for line in charts[key].lines]
        assert f"'{key}':(a,o)=>" in look.formulas


def test_pushes_and_timed_changes_make_segments():
    scenario = SCENARIOS["push"]
    ends = [(end, load[1]) for end, load in loads_of(scenario)]
    assert ends == [(0.2, 0.0), (pytest.approx(0.3), -15.0), (0.5, 0.0)]
    poured = run_data(simulate(load_scenario("poured-mass")))
    assert [len(segment["changes"]) for segment in poured["scenario"]["segments"]] == [0, 2]


def test_a_slider_of_all_fingers_sets_every_one():
    (control,) = controls_of(load_scenario("paper-case-1"), ["fingers.*.friction"])
    assert control.label == "friction of all fingers"
    assert (control.low, control.high, control.value) == (0.05, 1.0, 0.25)
    assert len(control.places) == 2


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("fingers.0.link_lengths.0", "changes the shape"),
        ("fingers.0.contact_offset", "cannot have a slider"),
        ("object.shape", "not a parameter with one number"),
        ("object.colour", "not a parameter with one number"),
        ("object.mass=3:1", "KEY=LOW:HIGH"),
        ("object.mass=light:heavy", "KEY=LOW:HIGH"),
    ],
)
def test_what_cannot_have_a_slider_is_refused(key, words):
    with pytest.raises(ControlError, match=words):
        controls_of(load_scenario("paper-case-1"), [key])


def test_a_slider_of_a_spatial_hand_sets_what_the_kernel_reads():
    prism = load_scenario("spatial-prism")
    mass, friction = controls_of(prism, usual_controls(prism))
    assert len(mass.places) == 1
    assert len(friction.places) == 2 * len(prism.fingers)  # kinetic and static
    lift = load_scenario("gripper-lift")
    (grip,) = controls_of(lift, ["controller.grip_force=4:10"])
    assert (grip.low, grip.high, grip.step) == (4.0, 10.0, 0.02)
    assert len(grip.places) == 2  # of the model, and of the run before it begins
    with pytest.raises(ControlError, match="of a spatial hand"):
        controls_of(lift, ["controller.force_bandwidth"])


def test_what_a_page_cannot_simulate_is_refused():
    with pytest.raises(PageError, match="patches"):
        write_page(simulate(load_scenario("wet-patch")), io.BytesIO(), ())


def test_every_end_of_a_run_has_words():
    result = simulate(load_scenario("paper-case-1"))
    ends = run_data(result)["ends"]
    assert len(ends) == 1 + len(end_words())
    for end in ends.values():
        blanks = set(re.findall(r"{(\w+)}", end["sentence"])) - {"finger"}
        assert blanks <= set(run_data(result)["blanks"])
        assert end["headline"]


def test_completed_runs_have_the_headlines_of_the_command_line():
    holds = run_data(simulate(load_scenario("paper-case-1")))["holds"]
    lasting = {"held": 0.6, "tooShort": 0.1}
    for name, duration in lasting.items():
        near = {"object.mass": 0.5, "controller.position_gain": 400.0}
        still = short("paper-case-1", **{"simulation.duration": duration, **near})
        assert holds[name] == headline_of(simulate(still))
    for name, duration in {"slipping": 0.05, "settling": 0.4}.items():
        assert holds[name] == headline_of(
            simulate(short("paper-case-1", **{"simulation.duration": duration}))
        )


@pytest.fixture(scope="module")
def page() -> str:
    stream = io.BytesIO()
    write_page(simulate(load_scenario("paper-case-1")), stream, ("object.mass",), COMMAND)
    return stream.getvalue().decode()


def content_of(page, name):
    (text,) = re.findall(rf'id="{name}">([^<]*)<', page)
    return unpack(text)


def test_the_file_is_small_and_asks_for_nothing_else(page):
    assert len(page.encode()) <= MOST_BYTES
    assert not re.search(r'(?:src|href)="https?:', page)


def test_the_file_has_the_same_bytes_again(page):
    stream = io.BytesIO()
    write_page(simulate(load_scenario("paper-case-1")), stream, ("object.mass",), COMMAND)
    assert stream.getvalue().decode() == page


def test_the_file_holds_the_kernel_and_both_themes(page):
    assert content_of(page, "sg-kernel")[:4] == b"\0asm"
    data = json.loads(content_of(page, "sg-data"))
    assert data["command"] == COMMAND
    assert {message["type"] for message in data["messages"]} >= {"MeshMessage", "GuiUplotMessage"}
    assert data["dark"]


@pytest.mark.parametrize("length", [0, 1, 5, 1000])
def test_packed_parts_can_be_unpacked(length):
    content = np.random.default_rng(length).bytes(length)
    assert unpack(pack(content)) == content


def test_the_code_of_viser_is_taken_from_its_page_without_what_pages_do_not_use():
    viewer = unpack_page(packed_page())
    assert viewer.decoder[:4] == b"\0asm"
    assert b"createRoot" in viewer.code and b".mantine" in viewer.style, CHANGED
    assert b"<script" not in viewer.page
    assert b"image/jpeg;base64,/" not in viewer.code, CHANGED
    assert b"enableDefaultLights:!1" in viewer.code, CHANGED
    # Orange is the colour of slip, not of the arrow to the mouse, whose head is small.
    assert b"16747586" not in viewer.code, CHANGED
    assert viewer.code.count(b".late=setTimeout") == 1, CHANGED
    assert viewer.code.count(b"{visible:!1,ref:") == 1, CHANGED
    assert b"Math.min(.04," in viewer.code and b"Math.min(.02," in viewer.code, CHANGED


def test_another_packing_of_viser_is_reported():
    with pytest.raises(PackingError, match="this version of viser"):
        unpack_page(b"<html><head></head></html>")


# What the page says to viser's page in place of its worker, and what it hears.
OUTGOING = """export type WsWorkerOutgoing =
  | { type: "connected" }
  | {
      type: "closed";
      versionMismatch?: boolean;
      clientVersion?: string;
      closeReason?: string;
    }
  | { type: "message_batch"; messages: Message[] };"""
INCOMING = """export type WsWorkerIncoming =
  | { type: "zstd_wasm"; module: WebAssembly.Module }
  | { type: "send"; message: Message }
  | { type: "set_server"; server: string }
  | { type: "retry" }
  | { type: "close" };"""
UNPACKER = """  ZSTD_decompress(
    dstPtr: number,
    dstSize: number,
    srcPtr: number,
    srcSize: number,
  ): number;"""
FIELDS = {
    "SetPositionMessage": {"name", "position", "owner"},
    "SetOrientationMessage": {"name", "wxyz", "owner"},
    "SetSceneNodeVisibilityMessage": {"name", "visible", "owner"},
    "SceneNodeUpdateMessage": {"name", "updates", "owner"},
    "GuiUpdateMessage": {"uuid", "updates"},
    "SetCameraPositionMessage": {"position", "initial"},
    "SetCameraLookAtMessage": {"look_at", "initial"},
    "GuiSetPanelWidthMessage": {"uuid", "width", "counter", "run_id"},
}
CHANGED = (
    f"viser {viser.__version__} changes what its page and its worker say to each other: "
    "adapt web/standalone/boot.js, recording.js and scene_feed.js, then this test"
)


def test_viser_and_its_worker_say_what_the_page_says():
    source = Path(viser.__file__).parent / "client" / "src" / "WebsocketClientWorker.ts"
    text = source.read_text(encoding="utf-8")
    assert OUTGOING in text and INCOMING in text, CHANGED
    unpacking = source.with_name("zstd.ts").read_text(encoding="utf-8")
    assert "globalThis.__viserZstdWasm" in unpacking and UNPACKER in unpacking, CHANGED
    for name, fields in FIELDS.items():
        found = {field.name for field in dataclasses.fields(getattr(_messages, name))}
        assert found == fields, f"{CHANGED}: {name} has {sorted(found)}"
