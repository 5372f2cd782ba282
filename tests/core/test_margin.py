"""How far a parameter can go: against a closed form, and against scanning every value."""

import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.study.margin import MarginError, find_margin
from slipgrasp.core.trace.types import Outcome

pytestmark = pytest.mark.slow

BELIEVED, SAFETY = 0.5, 1.1

# Nothing is learnt and nothing moves: the grip is what the believed friction asks for.
STILL = {
    "controller.lyapunov_weight": 0.0,
    "controller.estimate_norm_bound": 1e3,
    "controller.grip_safety": SAFETY,
    "estimates.0.initial": BELIEVED,
    "estimates.1.initial": BELIEVED,
    "estimates.2.initial": 1.0,
    "estimates.3.initial": 0.01042,
    "fingers.0.friction": 0.9,
    "fingers.1.friction": 0.9,
    "trajectory.acceleration": [0.0, 0.0, 0.0],
    "simulation.duration": 1.0,
}


def case(number, values):
    return with_values(load_scenario(f"paper-case-{number}"), values)


def is_held(scenario, key, value):
    return simulate(with_values(scenario, {key: value})).metrics.held


@pytest.mark.parametrize("key", ["fingers.0.friction", "fingers.1.friction"])
@pytest.mark.parametrize(("start", "stop"), [(0.2, 0.8), (0.8, 0.2)])
def test_least_friction_of_a_still_grasp_is_what_its_grip_needs(key, start, stop):
    """Each finger carries m g / 2 and presses s m g / (2 mu^): it sticks from mu = mu^ / s on."""
    margin = find_margin(case(2, STILL), key, start, stop)

    least = BELIEVED / SAFETY
    assert margin.lost_at < least < margin.held_at
    assert margin.held_at - margin.lost_at <= 1e-3 * 0.6
    assert margin.others == ()


def test_tolerance_says_how_near_both_sides_are():
    margin = find_margin(case(2, STILL), "fingers.0.friction", 0.2, 0.8, tolerance=1e-6)

    assert 0.0 < margin.held_at - margin.lost_at <= 0.6e-6
    assert margin.held_at == pytest.approx(BELIEVED / SAFETY, abs=0.6e-6)


def test_key_with_a_star_is_that_of_all_fingers():
    margin = find_margin(case(2, STILL), "fingers.*.friction", 0.2, 0.8)

    assert margin.key == "fingers.*.friction"
    assert margin.held_at == pytest.approx(BELIEVED / SAFETY, abs=1e-3)
    frictions = [finger.friction for finger in margin.lost.scenario.fingers]
    assert frictions == [margin.lost_at, margin.lost_at]


def test_heaviest_object_of_case_1_is_that_which_a_scan_finds():
    """Every twentieth of a kilogram, each simulated alone."""
    scenario = case(1, {"simulation.duration": 1.0})
    masses = [1.0 + 0.05 * k for k in range(81)]
    heaviest = max(mass for mass in masses if is_held(scenario, "object.mass", mass))

    margin = find_margin(scenario, "object.mass", 1.0, 5.0)

    assert heaviest - 0.004 <= margin.held_at < heaviest + 0.05
    assert margin.held_at < margin.lost_at <= margin.held_at + 0.004
    assert margin.unit == "kg"


def test_runs_of_both_sides_are_those_of_the_scenario_at_their_values():
    scenario = case(1, {"simulation.duration": 1.0})

    margin = find_margin(scenario, "object.mass", 1.0, 5.0)

    for result, mass in ((margin.held, margin.held_at), (margin.lost, margin.lost_at)):
        alone = simulate(with_values(scenario, {"object.mass": mass}))
        assert result.scenario == alone.scenario
        assert (result.trace.to_rows() == alone.trace.to_rows()).all()
    assert margin.held.metrics.held
    assert margin.outcome is margin.lost.outcome is Outcome.DIVERGED
    assert margin.lost.reason is not None
    assert margin.reason == margin.lost.reason.message


def test_where_the_lost_run_completes_the_reason_says_that_it_slips():
    """Short of time to slide off, and before the contacts chatter."""
    short = case(2, STILL | {"simulation.duration": 0.5})

    margin = find_margin(short, "fingers.0.friction", 0.2, 0.8)

    assert margin.outcome is Outcome.COMPLETED
    assert margin.lost.reason is None
    assert margin.reason == "still slipping at the end"


def test_whole_numbers_end_up_next_to_each_other():
    """The least number of steps that the run gets by with."""
    scenario = case(1, {})

    margin = find_margin(scenario, "simulation.max_steps", 50.4, 500)

    held_at, lost_at = margin.held_at, margin.lost_at
    assert isinstance(held_at, int) and isinstance(lost_at, int)
    assert held_at == lost_at + 1
    assert is_held(scenario, "simulation.max_steps", held_at)
    assert not is_held(scenario, "simulation.max_steps", lost_at)
    assert margin.outcome is Outcome.LIMIT


def test_further_borders_are_told_and_the_one_next_to_the_held_end_is_found():
    """Case II once a millisecond has no border: what holds lies next to what does not.

    Which of the lonely ones hold is chaotic: it turns with the last digits of the tolerance.
    """
    scenario = case(2, {"controller.control_period": 0.001})
    key = "fingers.1.friction"
    frictions = [0.25 + 0.25 * k / 16 for k in range(17)]
    held = [is_held(scenario, key, friction) for friction in frictions]
    borders = [frictions[k : k + 2] for k in range(16) if held[k] != held[k + 1]]
    assert len(borders) >= 3

    margin = find_margin(scenario, key, 0.25, 0.5)

    assert margin.to_mapping()["crossings"] == len(borders)
    assert borders[0][0] <= margin.held_at < margin.lost_at <= borders[0][1]
    assert margin.others == tuple(map(tuple, borders[1:]))


@pytest.mark.parametrize(
    ("start", "stop", "words"),
    [
        (0.5, 0.8, "held at both ends, 0.5 and 0.8: widen the range"),
        (0.2, 0.4, "held at neither end, 0.2 and 0.4: widen the range"),
    ],
)
def test_ends_that_agree_are_an_error_that_says_how(start, stop, words):
    with pytest.raises(MarginError) as found:
        find_margin(case(2, STILL), "fingers.0.friction", start, stop)

    assert str(found.value) == words
    assert found.value.held is ("both" in words)


def test_a_parameter_without_effect_is_said_to_have_none():
    """Phases are exact, so that nothing detects a slip."""
    with pytest.raises(MarginError, match="and makes no difference: all metrics are equal"):
        find_margin(case(2, STILL), "sensing.slip_delay", 0.0, 0.01)


def test_ends_that_agree_while_a_value_between_does_not_lead_there():
    """Frictions of case II are held only where they are nearly equal, at 0.25."""
    with pytest.raises(MarginError) as found:
        find_margin(case(2, {}), "fingers.1.friction", 0.05, 0.45)

    assert str(found.value) == (
        "held at neither end, 0.05 and 0.45, but held at 0.25: use it as one end of the range"
    )


def test_progress_rises_to_the_end():
    shares = []

    margin = find_margin(case(2, STILL), "fingers.0.friction", 0.2, 0.8, progress=shares.append)

    assert len(shares) == margin.runs
    assert shares == sorted(shares)
    assert shares[-1] == 1.0


BAD = {
    ("object.mas", 1.0, 2.0): "did you mean 'object.mass'?",
    ("fingers.7.friction", 0.1, 0.2): "unknown parameter 'fingers.7.friction'",
    ("controller.kind", 1.0, 2.0): "controller.kind is a choice",
    ("title", 1.0, 2.0): "title is a text",
    ("object.mass", 0.0, 2.0): r"object.mass is 0.0: .*allowed: 0.001 … 1000 kg",
    ("object.mass", 1.0, 2000.0): r"object.mass is 2000.0: .*allowed: 0.001 … 1000 kg",
    ("object.mass", float("nan"), 2.0): "from nan to 2 is not a range; give two finite numbers",
    ("object.mass", 2.0, 2.0): "from 2 to 2 is not a range; give two different values",
    ("simulation.max_steps", 100.2, 99.9): "from 100 to 100 is not a range",
}


@pytest.mark.parametrize("given", BAD, ids=map(str, BAD))
def test_what_has_no_range_is_refused(given):
    with pytest.raises(ScenarioError, match=BAD[given]):
        find_margin(load_scenario("paper-case-1"), *given)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 1.0, float("nan")])
def test_a_tolerance_out_of_bounds_is_refused(tolerance):
    with pytest.raises(ScenarioError, match=r"tolerance is .*allowed: 1e-12 … 0\.1"):
        find_margin(load_scenario("paper-case-1"), "object.mass", 1, 5, tolerance=tolerance)


def test_a_gripper_must_squeeze_harder_the_less_it_may_slip():
    scenario = with_values(load_scenario("gripper-lift"), {"simulation.duration": 1.5})
    at_rest = 0.4 * 9.81 / (2.0 * 0.35)
    found = [
        find_margin(scenario, "controller.grip_force", 25.0, 5.0, most_slip=most)
        for most in (0.0, 1e-4, 1e-3)
    ]
    forces = [margin.held_at for margin in found]
    assert forces == sorted(forces, reverse=True) and forces[-1] > at_rest
    for margin, most in zip(found, (0.0, 1e-4, 1e-3), strict=True):
        slips = [max(run.metrics.slip_path) for run in (margin.held, margin.lost)]
        assert slips[0] <= most < slips[1]
        assert margin.beyond == "slips too far" and margin.reason.startswith("a fingertip slipped ")
    with pytest.raises(ScenarioError, match="the slip limit is -1 m"):
        find_margin(scenario, "controller.grip_force", 25.0, 5.0, most_slip=-1.0)
