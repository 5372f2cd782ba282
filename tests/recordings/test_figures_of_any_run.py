import json

import numpy as np
import pytest
from matplotlib.patches import Polygon

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from slipgrasp.figures.drawings import draw_figures, figure_names
from slipgrasp.figures.schematic import start_pose
from slipgrasp.figures.slip_times import closer_look
from tests.held_polygon import CORNERS, held_polygon
from tests.recordings.reading_figures import axes_of, quantities, texts, titles

pytestmark = pytest.mark.slow

THIRD_FINGER = {"base": [1.466, -1.3], "face": "bottom", "contact_offset": 0.02, "friction": 0.3}


@pytest.fixture(scope="module")
def three_fingers():
    mapping = json.loads(json.dumps(load_scenario("paper-case-1").to_mapping()))
    mapping["fingers"].append(THIRD_FINGER)
    mapping["controller"] |= {"grasp_force": "none", "control_period": 0.001}
    mapping["simulation"]["duration"] = 0.1
    return simulate(scenario_from_mapping(mapping))


def test_only_the_papers_own_scenarios_get_its_numbers():
    scenario = load_scenario("paper-case-1")
    assert figure_names(scenario)["tracking"] == "fig-5-tracking"
    other = with_values(scenario, {"object.mass": 1.1})
    names = ["schematic", "tracking", "estimates", "forces", "premises"]
    assert list(figure_names(other).values()) == names


def test_a_run_that_ended_early_says_how_and_marks_when(lost_run):
    figures = draw_figures(lost_run)
    for name in ("tracking", "estimates", "forces"):
        assert "Ended early at 0.118 s: separated (right finger)" in texts(figures[name])
        marks = [line.get_xdata() for line in axes_of(figures[name], "a whole").lines]
        assert [lost_run.end_time] * 2 in [list(mark) for mark in marks]


def test_three_fingers_have_three_pairs_of_force_panels_and_three_lanes(three_fingers):
    figures = draw_figures(three_fingers)
    assert list(figures) == ["schematic", "tracking", "estimates", "forces", "premises"]
    assert titles(figures["forces"])[4:] == (
        "(e) joint torques of the bottom finger",
        "(f) force on the object by the bottom finger",
    )
    assert axes_of(figures["tracking"], "a phases whole").get_ylim() == (3, 0)
    assert len(quantities(figures["tracking"])) == 3 + 3 + 3


def test_a_controller_that_knows_everything_has_no_estimates_to_draw(run_without_unknowns):
    figures = draw_figures(run_without_unknowns)
    assert list(figures) == ["schematic", "tracking", "forces", "premises"]


def test_a_run_that_ends_at_once_is_drawn_as_points():
    """Six fingers that nothing makes squeeze: one of them loses contact in the first instant."""
    mapping = json.loads(json.dumps(load_scenario("paper-case-1").to_mapping()))
    mapping["fingers"] = [
        finger | {"base": [finger["base"][0], 0.3 * k], "contact_offset": side * (k - 1) * 0.1}
        for finger, side in zip(mapping["fingers"], (1, -1), strict=True)
        for k in range(3)
    ]
    mapping["controller"] |= {"grasp_force": "none", "control_period": 0.001}
    run = simulate(scenario_from_mapping(mapping))
    assert run.end_time == 0.0
    figures = draw_figures(run)
    ending = f"Ended early at 0 s: separated (left {run.reason.contact + 1} finger)"
    assert ending in texts(figures["tracking"])
    points = [line for line in axes_of(figures["forces"], "k whole").lines]
    assert {line.get_marker() for line in points if len(line.get_xdata()) == 1} == {"."}


def test_there_is_no_closer_look_where_nothing_or_most_of_the_run_slips(
    run_without_unknowns, short_run, lost_run
):
    assert not run_without_unknowns.metrics.last_slip_time
    for run in (run_without_unknowns, short_run, lost_run):
        assert closer_look(run) is None


def test_a_slip_in_the_middle_of_a_run_is_the_one_looked_at_if_it_is_the_longest():
    values = {
        "changes.0.time": 1.5,
        "changes.0.parameter": "object.mass",
        "changes.0.value": 1.5,
        "simulation.duration": 3.0,
    }
    run = simulate(with_values(load_scenario("paper-case-1"), values))
    start, end = closer_look(run)
    assert 1.4 < start < 1.5 < run.metrics.last_slip_time < end < 1.9


def test_the_schematic_of_a_polygon_has_its_corners_and_no_sides_of_a_rectangle():
    figure = draw_figures(simulate(held_polygon()))["schematic"]
    for label, shift in (("a", (1.466, 0.366)), ("b", (0.0, 0.0))):
        patches = axes_of(figure, label).patches
        drawn = [patch.get_xy() for patch in patches if isinstance(patch, Polygon)]
        outlines = [corners for corners in drawn if len(corners) == len(CORNERS) + 1]
        np.testing.assert_allclose(outlines[0][:-1], np.array(CORNERS) + shift, atol=1e-12)
    assert not any("L_o" in text for text in texts(figure))


def test_the_schematic_stands_as_the_simulated_hand_starts(three_fingers):
    """Inverse kinematics of the drawing against those of the simulation."""
    for i in range(3):
        pose = start_pose(three_fingers.scenario, i)
        angles = three_fingers.trace.joint_position[0, 2 * i : 2 * i + 2]
        np.testing.assert_allclose([pose.first, pose.second], angles, atol=1e-12)
        forearm = pose.first + pose.second
        end = pose.elbow + np.array([np.cos(forearm), np.sin(forearm)])
        np.testing.assert_allclose(pose.tip, end, atol=1e-12)
