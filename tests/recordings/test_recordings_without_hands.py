"""Runs of a body on a support and of a finger on a rail as files, tables and figures."""

import io

import numpy as np
import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.metrics import metrics_of_trace
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping
from slipgrasp.figures.drawings import draw_figures
from slipgrasp.figures.hand_motion import motion_of
from slipgrasp.recordings.compare.comparison import IncomparableError, compare
from slipgrasp.recordings.compare.verification import verify
from slipgrasp.recordings.engines.bodies import check_for_scene
from slipgrasp.recordings.export import write_csv, write_long_csv
from slipgrasp.recordings.file.pieces import read_ending
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.schemas import format_of, own_topics
from slipgrasp.recordings.file.segment import Segment, read_segment
from slipgrasp.recordings.file.versions import RAIL_FORMAT, SUPPORT_FORMAT
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.scene import skeleton
from slipgrasp.scene.states import states_of
from tests.recordings.reading_display import read_topic

PRESETS = {"slide": "spinning-slide", "push": "push-slider", "drag": "drag-slider"}
FORMATS = {"slide": SUPPORT_FORMAT, "pushed": SUPPORT_FORMAT}


@pytest.fixture(scope="module")
def runs():
    pulse = {"time": 0.1, "duration": 0.2, "force": [0.5, 2.0], "moment": 0.02}
    change = {"time": 0.2, "parameter": "support.friction", "value": 0.1}
    tables = {"support": {"radius": 0.03, "incline": 0.1}, "pulses": [pulse], "changes": [change]}
    found = {name: simulate(load_scenario(preset)) for name, preset in PRESETS.items()}
    return {**found, "pushed": simulate(scenario_from_mapping(tables))}


@pytest.mark.parametrize("name", ["slide", "pushed", "push", "drag"])
def test_a_run_reads_back_bit_for_bit_and_verifies(name, runs, same_run, tmp_path):
    run = runs[name]
    write_recording(run, tmp_path / "run.mcap")
    back = read_recording(tmp_path / "run.mcap")
    same_run(back, run)
    assert format_of(back.trace.shape) == FORMATS.get(name, RAIL_FORMAT)
    assert not back.trace.absent
    assert describe_run(back) == describe_run(run)
    found = verify(back)
    assert found.same and found.bit_for_bit
    assert read_ending(tmp_path / "run.mcap").end_time == run.end_time
    torques = Segment(signals=frozenset({"joint_torque"}))
    read = read_segment(tmp_path / "run.mcap", torques).joint_torque
    assert read.shape[1] == run.trace.joint_torque.shape[1]


@pytest.mark.parametrize(
    ("name", "has", "lacks", "drawn"),
    [
        (
            "slide",
            {"slip", "spin", "torsional_moment"},
            {"joint_torque", "tracking_error", "believed_phase"},
            {"object", "contact_0"},
        ),
        (
            "drag",
            {"joint_torque", "tracking_error", "lyapunov_value", "slip"},
            {"spin", "slip_path", "input_rank", "believed_phase"},
            {"object", "desired", "rail", "contact_0", "contact_1", "finger_0/link_1"},
        ),
    ],
)
def test_a_file_has_the_signals_and_parts_of_its_kind(runs, tmp_path, name, has, lacks, drawn):
    topics = own_topics(FORMATS.get(name, RAIL_FORMAT))
    names = {field.name for topic in topics for field in topic.fields}
    assert has <= names and not lacks & names
    write_recording(runs[name], tmp_path / "run.mcap")
    scenes = [scene for _, _, _, scene in read_topic(tmp_path / "run.mcap", "/scene")]
    found = {entity.id for entity in scenes[0].entities}
    assert drawn <= found and (name == "drag" or drawn == found)


@pytest.mark.parametrize("name", ["push", "drag"])
def test_the_drawn_fingertip_touches_the_object(name, runs):
    run = runs[name]
    poses = skeleton.world_poses(skeleton.frames_of(run.scenario), states_of(run.trace))
    tip, contact = (poses[frame][0] for frame in (skeleton.tip_frame(0), "contact_0"))
    assert np.abs(tip - contact).max() < 1e-12
    below = poses["contact_1"][0]
    assert np.abs(below[:, 2]).max() < 1e-12
    assert np.abs(below[:, 0] - run.trace.object_pose[:, 0]).max() < 1e-12


def test_metrics_of_samples_agree_with_those_of_the_run(runs):
    for name in ("slide", "drag"):
        run = runs[name]
        rate = run.scenario.simulation.output_rate
        found = metrics_of_trace(run.trace, run.phase_changes, run.outcome, rate).flattened()
        stated = run.metrics.flattened()
        exact = {"slip_path_0", "slip_path_1", "last_slip_time", "final_tracking_error_x"}
        compared = exact if name == "drag" else stated.keys()
        assert found.keys() == stated.keys()
        told = {key: stated[key] for key in compared}
        assert {key: found[key] for key in compared} == pytest.approx(told, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "head", "has", "lacks"),
    [
        ("slide", ["t", "x", "y", "theta"], "slip_x_0 spin_0 torsional_moment_0", "error_x"),
        ("push", ["t", "x", "error_x"], "slip_1 torque_0_1 estimate_object.mass", "y spin_0"),
    ],
)
def test_the_table_has_the_columns_of_its_kind_also_piece_by_piece(
    runs, tmp_path, name, head, has, lacks
):
    write_recording(runs[name], tmp_path / "run.mcap")
    long, short = io.BytesIO(), io.StringIO()
    write_long_csv(tmp_path / "run.mcap", long)
    write_csv(runs[name], short)
    assert long.getvalue().decode() == short.getvalue()
    header = short.getvalue().partition("\n")[0].split(",")
    assert header[: len(head)] == head
    assert set(has.split()) <= set(header) and not set(lacks.split()) & set(header)


def test_two_runs_are_compared_by_their_parameters_and_signals(runs):
    block = simulate(load_scenario("sliding-block"))
    for one, other, keys in (
        (runs["push"], runs["drag"], {"finger.angle", "controller.grip_force"}),
        (runs["slide"], block, {"support.radius", "motion.velocity.2"}),
    ):
        found = compare(one, other)
        assert {each.key for each in found.scenario} >= keys
        assert not found.equal
    with pytest.raises(IncomparableError, match="a body on a rail and a body on a support"):
        compare(runs["push"], block)
    with pytest.raises(IncomparableError, match="a body on a rail and a hand"):
        compare(runs["push"], simulate(load_scenario("paper-case-1")))


def test_the_outcome_is_told_in_words(runs):
    words = describe_run(runs["push"])
    assert words.headline == "Moved 599 mm; the fingertip did not slip"
    assert any("estimated mass went from 0.6 to" in each for each in words.sentences)
    assert describe_run(runs["drag"]).headline == "Moved 1000 mm; the fingertip slid 33.9 mm"


@pytest.mark.parametrize(
    ("name", "figures"),
    [
        ("slide", {"slips", "tracking", "forces"}),
        ("push", {"tracking", "estimates", "forces"}),
        ("drag", {"tracking", "forces"}),
    ],
)
def test_figures_are_drawn_and_what_needs_a_hand_is_refused_with_a_way_out(runs, name, figures):
    run = runs[name]
    assert set(draw_figures(run)) == figures
    with pytest.raises(ScenarioError, match=r"needs a hand.*slipgrasp figures"):
        motion_of(run, run.trace.times)
    with pytest.raises(ScenarioError, match=r"needs a hand.*slipgrasp export"):
        check_for_scene(run.scenario)
