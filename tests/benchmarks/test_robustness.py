"""The comparison of control laws: every law has the same choice, made on other objects."""

import numpy as np
import pytest

from benchmarks import claims, dot
from benchmarks.robustness import LAWS as STARTING_LAWS
from benchmarks.robustness import PRINTED, measure_start
from benchmarks.robustness_gains import (
    GAINS,
    HANDS,
    MORE_GAINS,
    TUNING_SEED,
    Cell,
    Objects,
    Result,
    Sample,
    can_predict,
    measure_best,
    measure_cell,
    measure_cells,
    plan,
    read_cells,
    scenarios_of,
    tabulate,
)
from benchmarks.robustness_worlds import (
    LATE,
    LAWS,
    PUBLISHED_LAWS,
    SEED,
    Held,
    random_objects,
    run_object,
)
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario

pytestmark = pytest.mark.slow

TINY = Sample((), (), late=Objects(3, 4), prompt=Objects(3, 4))


def scripted(held_by_gains):
    """Runs in which gains hold so many objects; the seeds of their draws are noted."""
    seeds = []

    def run(gains, count, seed):
        seeds.append(seed)
        held = held_by_gains.get(gains, 0)
        return [Held(k < held, True, 1e-3, 1.1) for k in range(count)]

    return run, seeds


def share(text):
    return float(text.split()[0])


def test_gains_are_chosen_on_other_objects_than_those_reported():
    run, seeds = scripted({GAINS[2]: 6})
    result = measure_best(run, 6, 10)
    assert result.gains == GAINS[2]
    assert seeds == [TUNING_SEED] * len(GAINS) + [SEED]
    assert not set(random_objects(60, seed=TUNING_SEED)[:, 0]) & set(random_objects(1000)[:, 0])


def test_the_first_of_gains_that_hold_as_much_is_chosen_and_counted():
    run, _ = scripted({GAINS[1]: 5, GAINS[3]: 5, MORE_GAINS[0]: 5})
    result = measure_best(run, 6, 10)
    assert (result.gains, result.tried) == (GAINS[1], (0, 5, 0, 5, 5, 0))
    assert (result.held, result.count, result.kept) == (5, 10, 10)
    assert result.safety == 1.1


def test_more_gains_are_tried_where_none_holds_all_and_taken_where_they_hold_more():
    run, seeds = scripted({GAINS[0]: 4, MORE_GAINS[1]: 5})
    assert measure_best(run, 6, 10).gains == MORE_GAINS[1]
    assert len(seeds) == len(GAINS) + len(MORE_GAINS) + 1


@pytest.mark.parametrize("law", LAWS)
def test_every_law_has_the_same_choice_of_gains_in_every_world(law):
    for gains in GAINS:
        for world in ("noise 1 mm/s", "latency 30 ms"):
            scenario = dot.scenario_of(Cell(2, world, law, False), 0, gains)
            assert scenario.controller.position_gain == gains[0]
            assert scenario.controller.velocity_gain == gains[1]
            assert not scenario.controller.prediction
    assert len({velocity for _, velocity in GAINS}) >= 3


@pytest.mark.parametrize("fingers", HANDS)
def test_every_built_in_law_is_compared_with_and_without_prediction_under_latency(fingers):
    cells = [cell for cell in plan() if cell.fingers == fingers]
    for law in HANDS[fingers].laws:
        late = [cell for cell in cells if cell.law == law and cell.world in LATE]
        ahead = [cell for cell in late if cell.predicts]
        assert len(ahead) == (0 if law in PUBLISHED_LAWS else len(late) / 2)
        assert all(dot.scenario_of(cell, 0).controller.prediction for cell in ahead[:1])
        assert (law in PUBLISHED_LAWS) == (not can_predict(law, LATE[0]))


def test_cells_are_stored_and_not_measured_again(tmp_path, monkeypatch):
    path = tmp_path / "cells.jsonl"
    cells = [Cell(2, "ideal", "oracle", False), Cell(3, "latency 50 ms", "composite", True)]
    monkeypatch.setattr("benchmarks.robustness_gains.HANDS", dict.fromkeys(HANDS, TINY))
    found = measure_cells(cells, path)
    assert [result.count for result in found.values()] == [4, 4]
    assert all(result.held == 4 for result in found.values())
    monkeypatch.setattr("benchmarks.robustness_gains.measure_cell", None)
    assert measure_cells(cells, path) == read_cells(path) == found


def test_prediction_and_damping_change_what_the_reflex_holds_under_latency():
    """The objects of the table: with K_v 10 and no prediction most are lost at 40 ms."""

    def held(gains, predicts):
        cell = Cell(2, "latency 40 ms", "grip reflex", predicts)
        return sum(run_object(each).held for each in scenarios_of(cell, gains, 20))

    assert held((100.0, 10.0), False) < held((100.0, 30.0), False) - 2
    assert held((100.0, 10.0), True) > held((100.0, 10.0), False) + 4


@pytest.mark.parametrize("fingers", [4, 6])
def test_a_hand_of_more_fingers_holds_as_the_cell_says(fingers):
    result = measure_cell(Cell(fingers, "ideal", "composite", False), Objects(1, 2))
    assert (result.held, result.kept, result.count) == (2, 2, 2)
    assert result.safety > 1.0


@pytest.mark.parametrize("predicts", [False, True])
def test_theorem_3_holds_what_theorem_4_holds(predicts):
    """It has no column of its own: nothing is pulled back in these runs."""
    three, four = (
        measure_cell(Cell(2, "latency 30 ms", law, predicts), Objects(1, 10))
        for law in ("theorem 3", "theorem 4")
    )
    assert three == four


def test_the_run_behind_a_cell_is_the_one_that_was_counted(capsys, tmp_path):
    cell = Cell(2, "latency 30 ms", "plain grip", True)
    counted = [run_object(each) for each in scenarios_of(cell, (25.0, 10.0), 20)]
    number = next(k for k, run in enumerate(counted) if not run.held)
    words = [cell.world, cell.law, "--number", str(number), "--gains", "25", "10", "--predicts"]
    dot.main(words)
    told = capsys.readouterr()
    assert told.err.startswith(f"object {number}: ")
    path = tmp_path / "dot.toml"
    path.write_text(told.out, encoding="utf-8")
    assert max(simulate(load_scenario(path)).metrics.slip_path) == counted[number].path


def test_objects_of_a_cell_have_their_own_noise():
    cell = Cell(3, "noise 3 mm/s", "composite", False)
    first, other = (dot.scenario_of(cell, k) for k in (0, 17))
    assert (first.simulation.seed, other.simulation.seed) == (0, 17)
    assert other.object.mass == random_objects(18, 3)[17, 0]
    (tuning,) = scenarios_of(cell, GAINS[0], 1, TUNING_SEED)
    assert tuning.simulation.seed not in range(1000)


def test_tables_have_every_cell_and_its_gains():
    found = {
        cell: Result(GAINS[k % 4], (1,) * 4, 10, k % 11, 10, 0.0, 1e-3, np.nan)
        for k, cell in enumerate(plan())
    }
    tables = tabulate(found)
    cells = sum(len(row) - 1 for table in tables[:-1] for row in table.rows)
    assert cells == len(plan())
    two, late = tables[:2]
    result = found[Cell(2, "push", "oracle", False)]
    row = next(row for row in two.rows if row[0] == "push")
    gains = "{:g}/{:g}".format(*result.gains)
    assert row[-1].startswith(f"{10 * result.held:.1f} %") and row[-1].endswith(gains)
    assert late.heads[1:3] == ("plain grip", "plain grip, predicts")


def test_the_composite_law_starts_from_the_paper_s_estimates_and_the_paper_s_laws_do_not():
    table = measure_start(20, 3)
    ideal = {row[0]: share(row[1]) for row in table.rows}
    assert [row[0] for row in table.rows[:-1]] == list(STARTING_LAWS)
    assert ideal["composite"] == 100.0
    assert ideal["theorem-4"] < 20.0
    assert ideal[PRINTED] < 60.0
    assert ideal[table.rows[-1][0]] > 90.0
    assert table.rows[2][1].endswith("100/10")


def test_holding_and_switching_are_compared_with_the_best_gains_of_both():
    late = claims.measure_switching(6, 2)
    assert list(late) == ["switches", "holds", "switches, predicts", "holds, predicts"]
    assert all(len(points) == len(claims.LATENCIES) for points in late.values())
    chosen = {point.gains for points in late.values() for point in points}
    assert chosen <= {*GAINS, *MORE_GAINS}
    assert late["holds, predicts"][-1].held == 6
