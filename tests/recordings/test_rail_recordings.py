"""Runs of a finger on a rail as files, tables, comparisons and figures."""

import io

import numpy as np
import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.metrics import metrics_of_trace
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.figures.drawings import draw_figures
from slipgrasp.figures.hand_motion import motion_of
from slipgrasp.recordings.compare.comparison import IncomparableError, compare
from slipgrasp.recordings.compare.verification import verify
from slipgrasp.recordings.engines.bodies import check_for_scene
from slipgrasp.recordings.export import write_csv, write_long_csv
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.schemas import format_of, own_topics
from slipgrasp.recordings.file.versions import RAIL_FORMAT
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.scene import skeleton
from slipgrasp.scene.states import states_of
from tests.recordings.reading_display import read_topic


@pytest.fixture(scope="module")
def push():
    return simulate(load_scenario("push-slider"))


@pytest.fixture(scope="module")
def drag():
    return simulate(load_scenario("drag-slider"))


@pytest.mark.parametrize("name", ["push", "drag"])
def test_a_run_reads_back_bit_for_bit_and_verifies(name, request, same_run, tmp_path):
    run = request.getfixturevalue(name)
    write_recording(run, tmp_path / "run.mcap")
    back = read_recording(tmp_path / "run.mcap")
    same_run(back, run)
    assert format_of(back.trace.shape) == RAIL_FORMAT
    assert not back.trace.absent
    assert describe_run(back) == describe_run(run)
    found = verify(back)
    assert found.same and found.bit_for_bit


def test_a_file_has_the_signals_of_a_rail(drag, tmp_path):
    topics = {topic.name: topic for topic in own_topics(RAIL_FORMAT)}
    names = {field.name for topic in topics.values() for field in topic.fields}
    assert {"joint_torque", "tracking_error", "lyapunov_value", "slip"} <= names
    assert not {"spin", "slip_path", "input_rank", "believed_phase"} & names
    write_recording(drag, tmp_path / "run.mcap")
    scenes = [scene for _, _, _, scene in read_topic(tmp_path / "run.mcap", "/scene")]
    drawn = {entity.id for entity in scenes[0].entities}
    assert {"object", "desired", "rail", "contact_0", "contact_1", "finger_0/link_1"} <= drawn


@pytest.mark.parametrize("name", ["push", "drag"])
def test_the_drawn_fingertip_touches_the_object(name, request):
    run = request.getfixturevalue(name)
    poses = skeleton.world_poses(skeleton.frames_of(run.scenario), states_of(run.trace))
    tip, contact = (poses[frame][0] for frame in (skeleton.tip_frame(0), "contact_0"))
    assert np.abs(tip - contact).max() < 1e-12
    below = poses["contact_1"][0]
    assert np.abs(below[:, 2]).max() < 1e-12
    assert np.abs(below[:, 0] - run.trace.object_pose[:, 0]).max() < 1e-12


def test_metrics_of_samples_agree_with_those_of_the_run(drag):
    rate = drag.scenario.simulation.output_rate
    found = metrics_of_trace(drag.trace, drag.phase_changes, drag.outcome, rate).flattened()
    assert found.keys() == drag.metrics.flattened().keys()
    exact = {"slip_path_0", "slip_path_1", "last_slip_time", "final_tracking_error_x"}
    assert {key: found[key] for key in exact} == pytest.approx(
        {key: drag.metrics.flattened()[key] for key in exact}, abs=1e-9
    )


def test_the_table_has_the_columns_of_a_rail(push, tmp_path):
    write_recording(push, tmp_path / "run.mcap")
    long, short = io.BytesIO(), io.StringIO()
    write_long_csv(tmp_path / "run.mcap", long)
    write_csv(push, short)
    assert long.getvalue().decode() == short.getvalue()
    header = short.getvalue().partition("\n")[0].split(",")
    assert header[:3] == ["t", "x", "error_x"]
    assert {"slip_0", "slip_1", "torque_0_1", "estimate_object.mass"} <= set(header)
    assert not {"y", "torque_1_0", "spin_0"} & set(header)


def test_two_runs_are_compared_by_their_parameters_and_signals(push, drag):
    found = compare(push, drag)
    assert {each.key for each in found.scenario} >= {"finger.angle", "controller.grip_force"}
    assert not found.equal
    with pytest.raises(IncomparableError, match="a body on a rail and a body on a support"):
        compare(push, simulate(load_scenario("sliding-block")))
    with pytest.raises(IncomparableError, match="a body on a rail and a hand"):
        compare(push, simulate(load_scenario("paper-case-1")))


def test_the_outcome_is_told_in_words(push, drag):
    words = describe_run(push)
    assert words.headline == "Moved 599 mm, the fingertip did not slip"
    assert any("estimated mass went from 0.6 to" in each for each in words.sentences)
    assert describe_run(drag).headline == "Moved 1000 mm, the fingertip slid 33.9 mm"


def test_figures_show_motion_forces_and_the_estimate(push, drag):
    assert set(draw_figures(push)) == {"tracking", "estimates", "forces"}
    assert set(draw_figures(drag)) == {"tracking", "forces"}


def test_what_needs_a_hand_is_refused_with_a_way_out(drag):
    with pytest.raises(ScenarioError, match=r"needs a hand.*rail.*slipgrasp figures"):
        motion_of(drag, drag.trace.times)
    with pytest.raises(ScenarioError, match=r"needs a hand.*rail.*slipgrasp export"):
        check_for_scene(drag.scenario)
