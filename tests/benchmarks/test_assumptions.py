"""The studies of what the paper leaves open, and their table."""

import math

import pytest

from benchmarks.assumptions import CASES, STUDIES, TEXTS, measure, run
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.study.loading import load_study

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def choices():
    return measure()


@pytest.mark.parametrize("case", CASES)
def test_a_study_begins_with_its_preset_and_changes_one_choice_at_a_time(case):
    study = load_study(STUDIES / f"assumptions-case-{case}.toml")
    assert study.scenario_of(0) == load_scenario(f"paper-case-{case}")
    values = [study.values_of(k) for k in range(1, study.num_runs)]
    assert all(next(iter(one)) in TEXTS for one in values)
    assert len({str(one) for one in values}) == len(values)


def test_choices_stand_in_the_order_of_their_effect(choices):
    effects = [choice.effect for choice in choices]
    assert effects == sorted(effects, reverse=True)
    assert math.isinf(effects[0])
    assert effects[-1] < 1e-6


def test_what_a_row_says_is_so(choices):
    """Of one run of case II, made here again."""
    choice = next(choice for choice in choices if choice.name == "weight $Q$: 100")
    study = load_study(STUDIES / "assumptions-case-2.toml")
    index = next(k for k in range(1, study.num_runs) if 100.0 in study.values_of(k).values())
    again = simulate(study.scenario_of(index))
    assert choice.runs[1][1].metrics.slip_path == again.metrics.slip_path
    (table,) = run()
    row = next(row for row in table.rows if row[0] == choice.name)
    assert row[4:6] == (
        f"{1e3 * max(again.metrics.slip_path):.3g}",
        f"{again.metrics.last_slip_time:.4f}",
    )
