"""What differs between two runs is told completely, and nothing else."""

import csv
import io
import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from slipgrasp.core.run.metrics import metrics_of_trace
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.compare.comparison import IncomparableError, ToleranceError, compare
from slipgrasp.recordings.export import write_csv

pytestmark = pytest.mark.slow

CASE_1 = load_scenario("paper-case-1")
SLIPPERIER = {"fingers.0.friction": 0.25 * 1.01}
EMPTY = {
    "equal": True,
    "scenario": [],
    "phase_changes": [],
    "first_divergence": {},
    "signals": {},
    "metrics": {},
    "cause": None,
    "integration_error": None,
    "contradictions": [],
}


@pytest.fixture(scope="module")
def case_1():
    return simulate(CASE_1)


@pytest.fixture(scope="module")
def slipperier():
    return simulate(with_values(CASE_1, SLIPPERIER))


def with_samples(run, change):
    """The run with samples changed in a copy of its rows."""
    rows = run.trace.to_rows().copy()
    change(rows)
    return replace(run, trace=Trace.from_rows(run.trace.shape, rows))


def restated(run):
    """The run with the metrics that its samples give."""
    rate = run.scenario.simulation.output_rate
    metrics = metrics_of_trace(run.trace, run.phase_changes, run.outcome, rate)
    return replace(run, metrics=metrics, has_sample_metrics=True)


def place_of(run, name):
    return [column.name for column in columns_of(run.trace)].index(name)


def shifted(run, name, row, step):
    def change(rows):
        rows[row, place_of(run, name)] += step

    return with_samples(run, change)


def table_of(run):
    """The CSV text of a run, read without any of the program's own code."""
    text = io.StringIO()
    write_csv(run, text)
    return list(csv.DictReader(io.StringIO(text.getvalue())))


def ends_by_time(table):
    """First and last line of each time in a table."""
    ends = {}
    for line in table:
        first, _ = ends.get(line["t"], (line, None))
        ends[line["t"]] = (first, line)
    return ends


def value(word):
    return {"stick": 0.0, "slip_forward": 1.0, "slip_backward": -1.0}.get(word) or float(
        {"stick": "0"}.get(word, word)
    )


def test_case_1_compared_with_itself_is_empty(case_1):
    comparison = compare(case_1, simulate(CASE_1))

    assert comparison.to_mapping() == EMPTY
    assert comparison.identical


def test_one_friction_changed_by_a_hundredth_is_told_as_the_tables_of_both_runs_show(
    case_1, slipperier
):
    told = compare(case_1, slipperier).to_mapping()
    one, other = table_of(case_1), table_of(slipperier)
    mine, others = ends_by_time(one), ends_by_time(other)
    common = sorted((t for t in mine if t in others), key=float)
    names = [name for name in one[0] if name != "t"]

    assert told["equal"] is False
    assert told["scenario"] == [{"key": "fingers.0.friction", "a": 0.25, "b": 0.2525}]
    for name in names:
        apart = [
            (float(t), abs(value(mine[t][k][name]) - value(others[t][k][name])))
            for t in common
            for k in (0, 1)
        ]
        limit = told["signals"][name]["tolerance"]
        beyond = [t for t, difference in apart if difference > limit]
        assert told["signals"][name]["max"] == max(difference for _, difference in apart), name
        assert told["first_divergence"].get(name) == min(beyond, default=None), name
    assert told["first_divergence"]["slip_0"] == told["first_divergence"]["slip_1"] == 0.0025
    assert told["signals"]["slip_0"]["tolerance"] == pytest.approx(1e-8 + 1e-6 * 2.59e-3, rel=1e-3)

    def returns_to_stick(table, contact):
        pairs = pairwise(table)
        return [
            float(after["t"])
            for before, after in pairs
            if before[f"phase_{contact}"] != "stick" and after[f"phase_{contact}"] == "stick"
        ]

    moved = {change["contact"]: change for change in told["phase_changes"]}
    assert len(moved) == len(told["phase_changes"]) == 2
    for contact, change in moved.items():
        assert [change["a"]] == returns_to_stick(one, contact)
        assert [change["b"]] == returns_to_stick(other, contact)
        assert change["time_difference"] == change["b"] - change["a"] != 0.0
        assert change["to"] == "stick"
    assert told["metrics"]["slip_path"]["a"] == case_1.metrics.slip_path
    assert told["metrics"]["slip_path"]["b"] == slipperier.metrics.slip_path


def test_the_same_run_stored_at_another_rate_is_equal_though_not_identical(case_1):
    slow = simulate(with_values(CASE_1, {"simulation.output_rate": 60.0}))

    comparison = compare(case_1, slow)

    assert comparison.equal and not comparison.identical
    told = comparison.to_mapping()
    assert told["scenario"] == [{"key": "simulation.output_rate", "a": 200.0, "b": 60.0}]
    assert told["first_divergence"] == {} and told["phase_changes"] == []
    assert told["signals"].keys() == {c.name for c in columns_of(case_1.trace)} - {"t"}
    assert told["metrics"].keys() == case_1.summary()["metrics"].keys()
    # Every 0.05 s, the events, and where rows inside the slip of both meet.
    common = set(case_1.trace.times.tolist()) & set(slow.trace.times.tolist())
    assert comparison.num_instants == len(common) == 141 + 2 + 5
    assert comparison.span == (0.0, 7.0)


def test_a_difference_at_one_sample_is_found_there_with_its_size(case_1):
    step = 0.125
    comparison = compare(case_1, shifted(case_1, "joint_velocity_1_0", 700, step), 0.1)

    time = case_1.trace.times[700]
    signal = comparison.signals["joint_velocity_1_0"]
    assert comparison.first_divergence == {"joint_velocity_1_0": time}
    assert (signal.time_of_max, signal.unit) == (time, "rad/s")
    assert signal.max == pytest.approx(step, rel=1e-12)
    # A triangle of the square over two sampling intervals, in a run of 7 s.
    assert signal.rms == pytest.approx(step * math.sqrt(0.005 / 7.0), rel=1e-9)
    assert not comparison.equal


def test_a_phase_change_is_equal_if_it_moved_within_the_tolerance(case_1):
    *before, last = case_1.phase_changes
    later = last.time + 2e-6

    def change(rows):
        rows[rows[:, 0] == last.time, 0] = later

    changes = (*before, replace(last, time=later))
    moved = restated(replace(with_samples(case_1, change), phase_changes=changes))

    (told,) = compare(case_1, moved).to_mapping()["phase_changes"]
    assert (told["contact"], told["a"]) == (last.contact, last.time)
    assert told["time_difference"] == pytest.approx(2e-6)
    assert compare(case_1, moved, 1e-5).equal


def test_a_phase_change_of_one_run_only_has_no_time_difference(case_1):
    without = replace(case_1, phase_changes=case_1.phase_changes[:-1])

    told = compare(case_1, without).to_mapping()

    last = case_1.phase_changes[-1]
    assert told["phase_changes"] == [
        {
            "contact": last.contact,
            "from": last.from_phase.label,
            "to": last.to_phase.label,
            "a": last.time,
            "b": None,
            "time_difference": None,
        }
    ]
    assert not told["equal"]


def test_runs_of_different_lengths_are_compared_as_far_as_both_go_and_are_not_equal(case_1):
    half = replace(case_1, trace=case_1.trace[:700])

    comparison = compare(half, case_1)

    assert not comparison.equal
    assert comparison.first_divergence == {}
    assert comparison.span == (0.0, half.end_time)
    assert comparison.end_times == (half.end_time, 7.0)
    assert comparison.metrics["end_time"] == (half.end_time, 7.0)


def test_other_unknowns_are_listed_and_the_common_ones_compared(case_1):
    comparison = compare(case_1, simulate(load_scenario("paper-case-2")))

    assert comparison.signals["estimate_object.mass"].unit == "kg"
    assert "estimate_fingers.0.link_masses.0" in comparison.only_a
    assert "estimate_fingers.0.friction" in comparison.only_b
    assert not {*comparison.only_a, *comparison.only_b} & comparison.signals.keys()
    (initial,) = (d for d in comparison.scenario if d.key == "estimates.4.initial")
    assert (initial.a, initial.b) == (0.5, None)


def test_hands_with_different_numbers_of_fingers_are_refused(case_1):
    short = {"simulation.duration": 0.05, "controller.grasp_force": "none"}
    third = replace(CASE_1.fingers[0], contact_offset=0.05)
    three = replace(with_values(CASE_1, short), fingers=(*CASE_1.fingers, third))

    with pytest.raises(IncomparableError, match=r"2 and 3 fingers.*choose"):
        compare(case_1, simulate(three))


def test_a_planar_against_a_spatial_hand_is_refused_for_their_axes_are_others():
    short = {"simulation.duration": 0.02}
    planar, spatial = (
        simulate(with_values(load_scenario(name), short))
        for name in ("three-fingers", "spatial-box")
    )

    for pair in ((planar, spatial), (spatial, planar)):
        with pytest.raises(IncomparableError, match=r"a planar and a spatial hand.*choose"):
            compare(*pair)


@pytest.mark.parametrize(("shift", "words"), [(0.001, "no instant"), (0.0, "only one instant")])
def test_runs_with_too_little_in_common_are_refused(case_1, shift, words):
    def change(rows):
        rows[1:, 0] += 0.001
        rows[0, 0] += shift

    apart = with_samples(replace(case_1, trace=case_1.trace[5:10]), change)

    with pytest.raises(IncomparableError, match=f"{words} in common.*output_rate"):
        compare(replace(case_1, trace=case_1.trace[5:10]), apart)


def test_a_run_that_ended_at_once_is_identical_to_itself(case_1):
    start = restated(
        replace(case_1, trace=case_1.trace[:1], phase_changes=(), outcome=Outcome.SEPARATED)
    )

    assert compare(start, start).to_mapping() == EMPTY


@pytest.mark.parametrize("tolerance", [-1e-9, math.nan, math.inf])
def test_a_tolerance_that_is_none_is_refused(case_1, tolerance):
    with pytest.raises(ToleranceError, match="allowed: a finite number of at least 0"):
        compare(case_1, case_1, tolerance)


def test_a_zero_tolerance_finds_the_last_bit(case_1):
    def change(rows):
        place = place_of(case_1, "slip_0")
        rows[300, place] = np.nextafter(rows[300, place], np.inf)

    comparison = compare(case_1, with_samples(case_1, change), 0.0)

    assert comparison.first_divergence == {"slip_0": case_1.trace.times[300]}


def test_numbers_as_large_as_they_get_give_finite_differences(case_1):
    def change(rows, sign):
        rows[100:, place_of(case_1, "slip_0")] = sign * 1.7e308

    runs = [with_samples(case_1, lambda rows, s=sign: change(rows, s)) for sign in (-1, 1)]
    signal = compare(*runs).signals["slip_0"]

    assert math.isfinite(signal.max) and 1e308 < signal.rms <= signal.max


def test_a_comparison_is_a_pandas_table_of_its_columns(case_1, slipperier):
    comparison = compare(case_1, slipperier)

    frame = comparison.to_pandas()

    assert list(frame.index) == list(comparison.signals)
    assert frame.loc["slip_0", "max"] == comparison.signals["slip_0"].max
    assert frame.loc["slip_0", "unit"] == "m"
    assert frame["first_divergence"].dropna().to_dict() == comparison.first_divergence
    assert compare(case_1, case_1).to_pandas().empty


@pytest.mark.parametrize("name", ["paper-case-1", "paper-case-2", "composite-case-2"])
@pytest.mark.parametrize(
    "event",
    [
        {"changes.0.time": 3.0, "changes.0.parameter": "object.mass", "changes.0.value": 1.6},
        {"pulses.0.time": 3.0, "pulses.0.force.1": -8.0},
        {"patches.0.face": "left", "patches.0.start_time": 3.0, "patches.0.half_length": 0.1},
    ],
    ids=["change", "push", "low-friction patch"],
)
def test_an_effect_is_dated_at_its_cause_and_never_before(name, event):
    base = load_scenario(name)
    comparison = compare(simulate(base), simulate(with_values(base, event)))

    assert comparison.cause == 3.0
    assert min(comparison.first_divergence.values()) == 3.0
    early = {name: s.before_cause for name, s in comparison.signals.items() if s.before_cause}
    error = comparison.integration_error
    assert (error is None) == (not early)
    if error is not None:
        assert error.before == 3.0
        assert error.max == early[error.column] < comparison.signals[error.column].tolerance


def test_a_tolerance_that_is_chosen_is_applied_before_the_cause_too():
    base = load_scenario("paper-case-2")
    change = {"changes.0.time": 3.0, "changes.0.parameter": "object.mass", "changes.0.value": 1.6}
    runs = simulate(base), simulate(with_values(base, change))

    exact = compare(*runs, 0.0)

    assert min(exact.first_divergence.values()) < 3.0
    assert all(signal.tolerance == 0.0 for signal in exact.signals.values())
    assert exact.integration_error is not None


@pytest.mark.parametrize("name", ["paper-case-1", "paper-case-2", "composite-case-2"])
def test_runs_that_were_integrated_more_exactly_are_equal(name):
    base = load_scenario(name)
    tight = {"simulation.relative_tolerance": 1e-11, "simulation.absolute_tolerance": 1e-13}
    runs = simulate(base), simulate(with_values(base, tight))

    assert compare(*runs).equal
    loose = {"simulation.relative_tolerance": 1e-5, "simulation.absolute_tolerance": 1e-7}
    coarse = compare(runs[0], simulate(with_values(base, loose)))
    assert coarse.signals["y"].tolerance > 900 * compare(*runs).signals["y"].tolerance


def test_a_run_that_contradicts_itself_is_not_equal_to_itself(case_1):
    forged = replace(case_1, metrics=replace(case_1.metrics, held=False, torque_effort=-1.0))

    comparison = compare(case_1, forged)

    assert not comparison.equal
    assert [(run, found.what) for run, found in comparison.contradictions] == [
        ("b", "held"),
        ("b", "torque_effort"),
    ]
    assert not compare(forged, forged).equal
    assert compare(forged, forged).to_mapping()["contradictions"][0] == {
        "run": "a",
        "what": "held",
        "stated": False,
        "computed": True,
    }
