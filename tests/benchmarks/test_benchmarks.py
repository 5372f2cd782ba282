"""A small sample of every benchmark, run for real: what it compares is comparable.

Nothing here judges a time; times only have to agree with each other where they must.
"""

import shutil
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks import (
    batch,
    catalogue,
    claims,
    front_ends,
    memory,
    onset,
    recording,
    scaling,
    space,
)
from benchmarks.__main__ import main
from benchmarks.charts import DIAGRAMS, by_columns, by_labels
from benchmarks.cluster import Costs, measure_costs_of_a_run, project
from benchmarks.hands import holding_hand
from benchmarks.mujoco_hold import hold_by_actuators, hold_by_numpy
from benchmarks.mujoco_replay import replay_in_mujoco, stepping
from benchmarks.report import Table, read_table, update_page
from benchmarks.speed import compare_speed, profile
from benchmarks.study import Load, make_study, run_over_rest
from benchmarks.timing import fit_exponent, fit_line, median_seconds
from benchmarks.work_precision import (
    Reference,
    measure_mujoco,
    measure_ours,
    oracle_difference,
)
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.trace.types import Outcome
from tests.references.closed_loop import ClosedLoop
from tests.references.hand import State

pytestmark = pytest.mark.slow

PAGE = Path(__file__).parents[2] / "docs" / "benchmarks.md"


@cache
def reference():
    return Reference("paper-case-2")


def column(table, index):
    return [float(row[index]) for row in table.rows]


# Timing


def test_every_work_takes_its_turn_in_every_round_and_once_before():
    calls = []
    seconds = median_seconds({name: lambda n=name: calls.append(n) for name in "abc"}, 4)
    assert calls[:3] == ["a", "b", "c"]
    rounds = [calls[k : k + 3] for k in range(3, 15, 3)]
    assert all(sorted(turn) == ["a", "b", "c"] for turn in rounds)
    assert len({tuple(turn) for turn in rounds}) > 1
    assert list(seconds) == ["a", "b", "c"]


def test_median_is_of_the_clock_that_is_given():
    ticks = iter([0.0, 1.0, 10.0, 15.0, 20.0, 22.0])
    assert median_seconds({"work": lambda: None}, 3, lambda: next(ticks)) == {"work": 2.0}


def test_fits_find_the_power_and_the_line_that_made_the_costs():
    sizes = np.array([2.0, 3.0, 4.0, 6.0])
    assert fit_exponent(sizes, 5.0 * sizes**3) == pytest.approx(3.0, rel=1e-12)
    line = fit_line(sizes, 2.0 + 0.5 * sizes)
    assert (line.intercept, line.slope) == pytest.approx((2.0, 0.5), rel=1e-12)
    assert line.deviation < 1e-12
    assert fit_line(sizes, 5.0 * sizes**3).deviation > 0.1


# Speed and batch


@pytest.mark.parametrize("case", ["paper-case-1", "spatial-prism"])
@pytest.mark.parametrize("hold", [hold_by_actuators, hold_by_numpy])
def test_mujoco_holds_the_object_between_all_fingertips_in_every_run(hold, case):
    """It sinks as its soft contacts and the springs of the PD law give, and no further."""
    scenario = load_scenario(case)
    held = hold(scenario, 1.0)
    sinking = []
    for _ in range(2):
        held.run()
        assert held.data.ncon == len(scenario.fingers)
        sinking.append(held.sinking())
    # Without grip it would have fallen by 4.9 m.
    assert 0.0 < sinking[0] < 0.01
    assert sinking[1] == pytest.approx(sinking[0], rel=1e-2)


def test_ratios_of_speed_are_those_of_the_times_beside_them():
    table = compare_speed(rounds=1, duration=0.1)
    cpu, alone, with_numpy = (column(table, index) for index in (1, 2, 3))
    assert len(cpu) == 6
    assert alone[0] == with_numpy[1] == 1.0
    # Printed to 0.01 ms and to a tenth.
    for k in range(2, 6):
        assert alone[k] == pytest.approx(cpu[0] / cpu[k], rel=0.02, abs=0.06)
        assert with_numpy[k] == pytest.approx(cpu[1] / cpu[k], rel=0.02, abs=0.06)


def test_profile_tells_the_cost_of_a_tick_only_where_control_ticks():
    table = profile(rounds=1, duration=0.1)
    for row in table.rows:
        assert min(float(part) for part in row[1:4]) > 0.0
        assert bool(row[4]) == ("1 kHz" in row[0])
        if row[4]:  # 100 ticks, printed to 0.01 ms and 0.01 us
            assert float(row[4]) == pytest.approx(10.0 * float(row[2]), abs=0.11)


def test_in_space_a_run_is_timed_beside_mujoco_and_by_its_parts():
    speed, parts = space.measure_cost(rounds=1, duration=0.05)
    cpu, with_numpy = column(speed, 1), column(speed, 3)
    assert with_numpy[2] == pytest.approx(cpu[1] / cpu[2], rel=0.02, abs=0.06)
    assert len(parts.rows) == 1
    slipping, sticking = (column(space.measure_units(calls=200), k) for k in (1, 2))
    assert min(slipping + sticking) > 0.0


def test_variants_of_a_batch_differ_and_are_the_same_every_time():
    first, again = (list(batch.vary("paper-case-1", 20, 0.5)) for _ in range(2))
    assert first == again
    masses = [scenario.object.mass for scenario in first]
    frictions = [finger.friction for scenario in first for finger in scenario.fingers]
    assert len(set(masses)) == 20
    assert 0.8 <= min(masses) < max(masses) <= 1.3
    assert 0.2 <= min(frictions) < max(frictions) <= 0.4


def test_batches_of_both_sides_are_compared_over_completed_runs():
    (table,) = batch.run(count=5, rounds=1, duration=0.3)
    rates, ratios = column(table, 1), column(table, 2)
    assert ratios[0] == 1.0
    # Rates are printed as whole numbers, ratios to a tenth.
    assert ratios[1] == pytest.approx(rates[1] / rates[0], rel=0.1, abs=0.1)
    assert table.notes[-1] == "Outcomes of our runs: 5 completed."


# Scaling and memory


@pytest.mark.parametrize("number", scaling.FINGERS)
def test_hands_of_two_to_six_fingers_hold_the_object_to_the_end(number):
    result = simulate(holding_hand(number))
    assert result.outcome is Outcome.COMPLETED
    assert result.metrics.held
    assert len(result.estimates) == 2 * number + 1
    # Everything sticks from the first instant, so runs differ by their size alone.
    assert result.phase_changes == ()
    assert result.trace.friction_margin.min() > 0.0


def test_scaling_has_the_cost_of_every_size_it_measured():
    durations = scaling.measure_duration((0.2, 0.4), rounds=1)
    fingers = scaling.measure_fingers((2, 3, 4), rounds=1, duration=0.2)
    assert column(durations, 0) == [0.2, 0.4] and column(fingers, 0) == [2.0, 3.0, 4.0]
    for table in (durations, fingers):
        assert min(column(table, 1) + column(table, 2)) > 0.0


# Diagrams


@pytest.mark.parametrize("image", DIAGRAMS)
def test_diagrams_are_drawn_from_the_tables_of_their_pages(image):
    diagram = DIAGRAMS[image]
    tables = [read_table(PAGE.parent / diagram.page, name) for name in diagram.tables]
    figure = diagram.draw(*tables)
    assert len(figure.axes) >= 2
    assert all(axes.lines or axes.images or axes.collections for axes in figure.axes)


def test_curves_of_a_diagram_have_the_numbers_and_intervals_of_a_table():
    rows = [["latency [ms]", "a", "b"], ["0", "98.8 % (97.4–99.4), 25/30; 1/2", "1.5"]]
    assert by_columns(rows) == {"a": [[0.0, 98.8, 97.4, 99.4]], "b": [[0.0, 1.5]]}
    rows = [["of", "s", "error"], ["one", "2", "1e-07"], ["other", "3", "2"]]
    assert by_labels(rows, 1, 2) == {"one": [[2.0, 1e-7]], "other": [[3.0, 2.0]]}


# Memory


def test_peak_memory_is_that_of_a_process_of_its_own():
    """A peak is never below what is in use, and the child's knows nothing of ours."""
    ballast = np.ones(50_000_000)  # 400 MB
    assert memory.peak_memory() > ballast.nbytes
    peak = memory.measure_memory(8)
    # An interpreter with the compiled kernel, and nothing like the ballast.
    assert 5e7 < peak < ballast.nbytes


# Accuracy


def test_our_onset_is_the_closed_form_and_mujoco_s_is_within_its_step():
    """MuJoCo tells whole steps; the line through two of them is nearer by about a half."""
    for coasting in onset.COASTING[:3]:
        scenario, exact = onset.turning_hand(coasting)
        assert onset.our_onset(scenario) == pytest.approx(exact, abs=1e-9)
        for step in (1e-3, 1e-4):
            told, extrapolated = onset.mujoco_onset(scenario, step)
            assert abs(told - exact) < 1.5 * step
            assert abs(extrapolated - exact) < 0.5 * step


def test_onsets_fall_on_all_parts_of_a_step():
    parts = sorted((coasting / 1e-3) % 1.0 for coasting in onset.COASTING)
    assert np.diff([*parts, parts[0] + 1.0]).max() < 0.2


def test_reference_of_the_diagram_agrees_with_the_oracle_of_the_tests():
    # The oracle's relative tolerance, on a time of 0.1 s that follows from speeds of 0.5 m/s.
    assert oracle_difference(reference()) < 1e-9


def test_errors_of_both_engines_fall_with_their_settings_and_ours_are_smaller():
    ours = measure_ours(reference(), (1e-4, 1e-7, 1e-10), rounds=1)
    mujoco = measure_mujoco(reference(), (1e-3, 2.5e-4), rounds=1)
    for rows in (ours, mujoco):
        for k in (3, 4):
            errors = [float(row[k]) for row in rows]
            assert errors == sorted(errors, reverse=True)
            assert errors[-1] > 0.0
        assert all(float(row[2]) > 0.0 for row in rows)
    # Our loosest run against the finest MuJoCo: events are located, not stepped over.
    assert all(float(ours[0][k]) < float(mujoco[-1][k]) for k in (3, 4))


def test_replay_that_is_timed_is_the_one_that_is_judged():
    replay = replay_in_mujoco(reference().torques, 1e-3)
    states, _ = stepping(reference().torques, 1e-3)()
    poses = states[0, :, 5:8]  # time, four joint angles, then the object
    np.testing.assert_array_equal(poses, replay.object_pose)


# Report


def test_page_keeps_everything_outside_the_marks(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- a -->\nold\n<!-- end a -->\nafter\n")
    for _ in range(2):
        update_page(page, [Table("a", ("x", "y"), (("one", "1"),))])
        assert page.read_text() == (
            "before\n<!-- a -->\n\n| x | y |\n| --- | --: |\n| one | 1 |\n\n<!-- end a -->\nafter\n"
        )
    assert read_table(page, "a") == [["x", "y"], ["one", "1"]]
    with pytest.raises(ValueError, match="no marks for 'b'"):
        update_page(page, [Table("b", ("x",), ())])


def test_rows_of_a_table_go_into_the_file_that_the_page_names(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("before\n\nData: [a.csv](data/a.csv). Missed.\n\nafter\n")
    update_page(page, [Table("a", ("x", "y"), (("one", "1, 2"),), ("Met.",))])
    assert page.read_text() == ("before\n\nData: [a.csv](data/a.csv). Met.\n\nafter\n")
    assert (tmp_path / "data" / "a.csv").read_text() == 'x,y\none,"1, 2"\n'
    assert read_table(page, "a") == [["x", "y"], ["one", "1, 2"]]


def test_one_command_prints_a_part_and_writes_its_table(tmp_path, capsys):
    page = tmp_path / "benchmarks.md"
    shutil.copy(PAGE, page)
    main(["onset", "--docs", str(tmp_path)])
    printed = capsys.readouterr().out
    rows = [row for row in read_table(page, "onset") if row[0].startswith("MuJoCo, 1 ms")]
    words = [" ".join(" ".join(row).split()) for row in rows]
    shown = [" ".join(line.split()) for line in printed.splitlines()]
    assert len([line for line in words if line in shown]) == 2


def test_unknown_part_is_refused_with_the_known_ones(capsys):
    with pytest.raises(SystemExit) as refusal:
        main(["sped"])
    assert refusal.value.code == 2
    assert "no part sped; parts: speed, space" in capsys.readouterr().err


def test_recording_is_measured_on_the_file_it_writes():
    (table,) = recording.run(rounds=1, duration=0.2)
    assert min(column(table, 1)) > 0.0
    assert "frames." in table.notes[1]


def test_catalogue_is_measured_on_pages_that_it_gives():
    (table,) = catalogue.run(rounds=1, count=30)
    assert table.heads[0] == "30 recordings" and len(table.rows) == 5
    assert min(column(table, 1)) >= 0.0 and "in the background" in table.notes[0]


# Studies


class Scripted:
    """A service whose study is so far at each look; an answer takes a second."""

    def __init__(self, *states):
        self.states = iter(states)
        self.now = 0.0

    def ask(self, path, body=None):
        self.now += 1.0
        if body is not None:
            return {"id": "x", "num_runs": 60}
        state, finished = next(self.states)
        return {"state": state, "finished": finished}

    def seconds_of(self, path):
        self.now += 1.0
        return 1.0

    def sleep(self, seconds):
        self.now += seconds


@pytest.mark.parametrize(
    ("states", "runs", "seconds"),
    [
        ([("queued", 0), ("running", 20), ("running", 40), ("completed", 60)], 40, 4.2),
        ([("completed", 60)], 0, 0.0),
    ],
)
def test_a_study_over_rest_is_timed_from_its_first_results(monkeypatch, states, runs, seconds):
    service, load = Scripted(*states), Load()
    clock = SimpleNamespace(
        perf_counter=lambda: service.now, monotonic=lambda: service.now, sleep=service.sleep
    )
    monkeypatch.setattr("benchmarks.study.time", clock)
    study, rate = run_over_rest(service, {}, load)
    assert (study, load.finished) == ("x", 60)
    assert load.seconds == pytest.approx(seconds)
    assert rate * load.seconds == pytest.approx(runs)


def test_a_cluster_that_outruns_its_scheduler_needs_more_of_them():
    costs = Costs(
        worker=0.01,
        scheduler=0.001,
        rates={"1 worker process": 100.0},
        tasks={"Dask, 2 workers": 100.0},
        row=300.0,
    )
    table = project(costs)
    assert [row[0] for row in table.rows] == ["2", "16", "128", "1024"]
    assert [row[3] for row in table.rows] == ["1", "2", "13", "103"]
    assert [row[1] for row in table.rows] == ["83 min", "17 min", "17 min", "17 min"]
    assert table.rows[0][2] == table.rows[0][4] == "58 days"
    assert "(300 MB)" in table.notes[0] and "(300 GB)" in table.notes[0]


def test_cost_of_a_run_is_that_of_its_worker_and_that_of_its_scheduler():
    worker, scheduler, row = measure_costs_of_a_run(make_study(40), rounds=1)
    assert worker > scheduler > 0.0
    assert 100.0 < row < 2000.0


# Robustness


def test_a_tick_is_measured_in_every_front_end():
    (table,) = front_ends.run(rounds=1, duration=0.05)
    costs = [float(row[1]) for row in table.rows]
    assert len(costs) == 6
    assert min(costs) > 0.0
    assert costs[2] > costs[0], "Python costs more than the built-in law"


def test_the_noise_that_fails_a_row_is_that_of_its_definition():
    """White noise through the filter and the vertical row of M~, drawn, against what is said."""
    scenario = load_scenario("composite-case-2")
    noise = claims.noise_that_fails(scenario)
    loop = ClosedLoop.from_scenario(scenario)
    start = np.array(scenario.trajectory.start)
    kin = loop.hand.kinematics(State(start, np.zeros(3), np.zeros(2), np.zeros(2)))
    row = loop.hand.reduced_form(kin, loop.truth, (0, 0)).M[1, :3]
    drawn = np.random.default_rng(2).normal(0.0, noise, (100_000, 3))
    share, value, errors = 0.001 / 0.007, np.zeros(3), []
    for slope in np.diff(drawn, axis=0) / 0.001:
        value = value + share * (slope - value)
        errors.append(row @ value)
    assert np.std(errors[100:]) == pytest.approx(claims.EXPECTED, rel=0.02)
