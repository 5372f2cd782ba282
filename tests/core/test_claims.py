"""What a run states of itself is held against its samples."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slipgrasp.core.run.claims import contradictions_of, describe_false_end
from slipgrasp.core.run.metrics import metrics_of_trace
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, preset_names, with_values
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import Outcome
from tests.core.drawn_scenarios import KINDS, draw_scenario

SEEDS = (0, 1, 5)  # of the last, some runs end at their first instant


@pytest.fixture(scope="module")
def run():
    return simulate(with_values(load_scenario("paper-case-2"), {"simulation.duration": 1.0}))


def claims_against(run):
    return [found.what for found in contradictions_of(run)]


@pytest.mark.parametrize("name", preset_names())
def test_no_preset_contradicts_itself(name):
    assert contradictions_of(simulate(load_scenario(name))) == ()


@pytest.mark.parametrize("seed", SEEDS)
def test_no_random_run_contradicts_itself_however_it_ends(seed):
    runs = [simulate(draw_scenario(kind, seed)) for kind in KINDS]

    assert {run.outcome for run in runs} >= {Outcome.COMPLETED, Outcome.SEPARATED}
    assert any(len(run.trace) == 1 for run in runs) or seed != 5
    for run in runs:
        assert contradictions_of(run) == ()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("held", False),
        ("slipping_at_end", True),
        ("last_slip_time", None),
        ("phase_change_count", 5),
    ],
)
def test_a_metric_that_the_samples_do_not_give_is_named_with_both_values(run, name, value):
    (found,) = contradictions_of(replace(run, metrics=replace(run.metrics, **{name: value})))

    assert (found.what, found.stated) == (name, value)
    assert found.computed == pytest.approx(getattr(run.metrics, name), rel=1e-12)
    assert str(found) == f"{name} is stated as {value}, its samples give {found.computed}"


def test_a_run_that_is_too_short_to_tell_may_not_state_to_have_held():
    firm = {"controller.kind": "grip-reflex", "controller.control_period": 0.001}
    values = {**firm, "controller.grip_force": 100.0, "simulation.duration": 0.01}
    short = simulate(with_values(load_scenario("paper-case-1"), {**values, "object.mass": 0.5}))
    (found,) = contradictions_of(replace(short, metrics=replace(short.metrics, held=True)))
    assert (found.what, found.stated, found.computed) == ("held", True, None)


def test_one_entry_of_a_list_is_named_by_its_contact_or_coordinate(run):
    left, right = run.metrics.slip_path
    x, y, theta = run.metrics.final_tracking_error
    metrics = replace(
        run.metrics,
        slip_path=(left, right + 1e-6),
        minimum_friction_margin=(None, run.metrics.minimum_friction_margin[1]),
        final_tracking_error=(x, y, theta + 1.0),
    )

    assert claims_against(replace(run, metrics=metrics)) == [
        "slip_path_1",
        "minimum_friction_margin_0",
        "final_tracking_error_theta",
    ]


def test_what_happened_between_the_samples_is_known_by_bounds(run):
    peaks, margins = run.metrics.peak_normal_force, run.metrics.minimum_friction_margin

    def claims(**values):
        return claims_against(replace(run, metrics=replace(run.metrics, **values)))

    assert claims(peak_normal_force=(1.1 * peaks[0], peaks[1])) == []
    assert claims(peak_normal_force=(0.9 * peaks[0], peaks[1])) == ["peak_normal_force_0"]
    assert claims(minimum_friction_margin=(margins[0], 0.5 * margins[1])) == []
    greater = (margins[0], margins[1] + 1.0)
    assert claims(minimum_friction_margin=greater) == ["minimum_friction_margin_1"]
    assert claims(torque_effort=1.0) == []
    assert claims(torque_effort=-1.0) == ["torque_effort"]
    assert claims(torque_effort=math.nan) == ["torque_effort"]


def test_metrics_of_samples_must_be_those_of_the_samples(run):
    rate = run.scenario.simulation.output_rate
    metrics = metrics_of_trace(run.trace, run.phase_changes, run.outcome, rate)
    old = replace(run, metrics=metrics, has_sample_metrics=True)

    assert contradictions_of(old) == ()
    (found,) = contradictions_of(replace(old, metrics=replace(metrics, torque_effort=1.0)))
    assert (found.what, found.stated, found.computed) == (
        "torque_effort",
        1.0,
        metrics.torque_effort,
    )


def test_sums_in_another_order_are_the_same_metric(run):
    rounded = replace(run.metrics, torque_effort=run.metrics.torque_effort * (1.0 + 1e-12))

    assert contradictions_of(replace(run, metrics=rounded)) == ()


def test_a_completed_run_must_have_reached_its_duration(run):
    longer = with_values(run.scenario, {"simulation.duration": 2.0})
    (found,) = contradictions_of(replace(run, scenario=longer))

    assert (found.what, found.stated) == ("outcome", "completed")
    assert found.computed == "ended at 1 s of 2 s"
    assert contradictions_of(replace(run, scenario=longer, outcome=Outcome.STOPPED)) != ()
    assert "outcome" not in claims_against(replace(run, scenario=longer, outcome=Outcome.STOPPED))


def test_a_completed_run_must_be_finite_at_its_end(run):
    rows = run.trace.to_rows().copy()
    rows[-1, -1] = np.nan
    broken = replace(run, trace=Trace.from_rows(run.trace.shape, rows))

    (found,) = (each for each in contradictions_of(broken) if each.what == "outcome")
    assert found.computed == "not finite at 1 s"


@pytest.mark.parametrize("end", [0.0, 6.9999, np.nan, np.inf])
def test_only_the_whole_duration_is_complete(end):
    assert describe_false_end(Outcome.COMPLETED, end, 7.0) == f"ended at {end:g} s of 7 s"
    assert describe_false_end(Outcome.SEPARATED, end, 7.0) == ""
    assert describe_false_end(Outcome.COMPLETED, 7.0, 7.0) == ""


def test_phase_changes_must_be_those_of_the_samples(run):
    first = min(change.time for change in run.phase_changes)
    fewer = replace(run, phase_changes=run.phase_changes[:-1])
    (found, *_) = contradictions_of(fewer)

    assert found.what == "phase_changes"
    assert "slip" in found.stated and found.computed.startswith("stick")
    late = tuple(replace(c, time=c.time + 0.02) for c in run.phase_changes)
    assert "phase_changes" in claims_against(replace(run, phase_changes=late))
    assert first < 0.05


@pytest.fixture(scope="module")
def spatial_run():
    return simulate(load_scenario("spatial-prism"))


@pytest.mark.parametrize("factor", [0.0, 0.5, 1.0 - 1e-5, 1.0 + 1e-5, 2.0, -1.0])
def test_slips_in_space_that_the_poses_do_not_give_are_named(spatial_run, factor):
    slip = factor * spatial_run.trace.slip
    forged = replace(spatial_run, trace=replace(spatial_run.trace, slip=slip))

    assert claims_against(forged) == ["slip_0", "slip_1", "slip_2"]


def test_a_path_in_space_that_is_shorter_than_its_slips_is_named(spatial_run):
    path = 0.9 * spatial_run.trace.slip_path
    metrics = replace(spatial_run.metrics, slip_path=tuple(path[-1].tolist()))
    forged = replace(spatial_run, metrics=metrics, trace=replace(spatial_run.trace, slip_path=path))

    assert claims_against(forged) == ["slip_path_0", "slip_path_1", "slip_path_2"]
