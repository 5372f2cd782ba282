"""Runs of a body on a support as files, tables, comparisons and figures."""

import io

import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.metrics import metrics_of_trace
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping
from slipgrasp.figures.drawings import draw_figures
from slipgrasp.figures.hand_motion import motion_of
from slipgrasp.recordings.compare.comparison import compare
from slipgrasp.recordings.compare.verification import verify
from slipgrasp.recordings.engines.bodies import check_for_scene
from slipgrasp.recordings.export import write_csv, write_long_csv
from slipgrasp.recordings.file.pieces import read_ending
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.schemas import format_of, own_topics
from slipgrasp.recordings.file.segment import Segment, read_segment
from slipgrasp.recordings.file.versions import SUPPORT_FORMAT
from slipgrasp.recordings.file.writer import write_recording
from tests.recordings.reading_display import read_topic


@pytest.fixture(scope="module")
def slide():
    return simulate(load_scenario("spinning-slide"))


@pytest.fixture(scope="module")
def pushed():
    pulse = {"time": 0.1, "duration": 0.2, "force": [0.5, 2.0], "moment": 0.02}
    change = {"time": 0.2, "parameter": "support.friction", "value": 0.1}
    tables = {"support": {"radius": 0.03, "incline": 0.1}, "pulses": [pulse], "changes": [change]}
    return simulate(scenario_from_mapping(tables))


@pytest.mark.parametrize("name", ["slide", "pushed"])
def test_a_run_reads_back_bit_for_bit_and_verifies(name, request, same_run, tmp_path):
    run = request.getfixturevalue(name)
    write_recording(run, tmp_path / "run.mcap")
    back = read_recording(tmp_path / "run.mcap")
    same_run(back, run)
    assert format_of(back.trace.shape) == SUPPORT_FORMAT
    assert not back.trace.absent
    assert describe_run(back) == describe_run(run)
    found = verify(back)
    assert found.same and found.bit_for_bit


def test_a_file_has_no_topics_of_hands(slide, tmp_path):
    names = {topic.name for topic in own_topics(SUPPORT_FORMAT)}
    assert {"/slipgrasp/object", "/slipgrasp/contacts", "/slipgrasp/energy"} <= names
    assert not {"/slipgrasp/joints", "/slipgrasp/controller"} & names
    write_recording(slide, tmp_path / "run.mcap")
    scenes = [scene for _, _, _, scene in read_topic(tmp_path / "run.mcap", "/scene")]
    assert {entity.id for entity in scenes[0].entities} == {"object", "contact_0"}


def test_metrics_of_samples_agree_with_those_of_the_run(slide):
    rate = slide.scenario.simulation.output_rate
    found = metrics_of_trace(slide.trace, slide.phase_changes, slide.outcome, rate).flattened()
    assert found == pytest.approx(slide.metrics.flattened(), abs=1e-9)
    assert "torque_effort" not in found


def test_the_table_has_the_columns_of_a_slide(slide):
    stream = io.StringIO()
    write_csv(slide, stream)
    header = stream.getvalue().partition("\n")[0].split(",")
    assert header[:4] == ["t", "x", "y", "theta"]
    assert {"slip_x_0", "spin_0", "torsional_moment_0", "normal_force_0"} <= set(header)
    assert not any(name.startswith(("error", "torque", "joint")) for name in header)


def test_a_long_recording_is_exported_piece_by_piece(slide, tmp_path):
    write_recording(slide, tmp_path / "run.mcap")
    long, short = io.BytesIO(), io.StringIO()
    write_long_csv(tmp_path / "run.mcap", long)
    write_csv(slide, short)
    assert long.getvalue().decode() == short.getvalue()
    assert read_ending(tmp_path / "run.mcap").end_time == slide.end_time
    torques = Segment(signals=frozenset({"joint_torque"}))
    assert read_segment(tmp_path / "run.mcap", torques).joint_torque.shape[1] == 0


def test_two_runs_are_compared_by_their_parameters_and_signals(slide):
    other = simulate(load_scenario("sliding-block"))
    found = compare(slide, other)
    assert {each.key for each in found.scenario} >= {"support.radius", "motion.velocity.2"}
    assert not found.equal


def test_figures_show_motion_friction_and_path(slide):
    assert set(draw_figures(slide)) == {"slips", "tracking", "forces"}


def test_what_needs_a_hand_is_refused_with_a_way_out(slide):
    with pytest.raises(ScenarioError, match=r"needs a hand.*slipgrasp figures"):
        motion_of(slide, slide.trace.times)
    with pytest.raises(ScenarioError, match=r"needs a hand.*slipgrasp export"):
        check_for_scene(slide.scenario)
