"""A small sample of `benchmarks.outcomes`, and each of its checks on runs that it must refuse."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.__main__ import main
from benchmarks.outcome_checks import CHECKS, PLANAR, Judgement, Pair
from benchmarks.outcome_truth import Comparison, compare, tabulate_truth
from benchmarks.outcomes import Campaign, judge_many, tabulate
from benchmarks.random_runs import ANYWHERE, AT_ENDS, ON_BOUNDS, PAIRS, POPULATIONS, draw
from benchmarks.report import share_interval
from benchmarks.robustness import SWEEPS, measure_outcomes, measure_sweep
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, parameter_definitions, with_values
from slipgrasp.core.trace.types import ContactPhase, Outcome, PhaseChange, Reason
from tests.references.instant import answers_at_end
from tests.references.open_contacts import OPEN

pytestmark = pytest.mark.slow

SEED = 3
HELD = with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.2})


@pytest.fixture(scope="module")
def held():
    return simulate(HELD)


def missed(run, fine=None):
    """Names of the checks that a run misses; it looks the same with a finer output."""
    return set(PLANAR.find_missed(Pair(run, np.zeros((2, 2)), fine or run)))


def torques_of(run):
    """Those at its end, ``(2, 2)``."""
    return run.trace.joint_torque[-1].reshape(2, 2)


def with_signal(run, name, values):
    return replace(run, trace=replace(run.trace, **{name: values}))


def with_changes(run, changes):
    count = replace(run.metrics, phase_change_count=len(changes))
    return replace(run, phase_changes=tuple(changes), metrics=count)


def chatter(times):
    """Phase changes of contact 0, to and fro."""
    stick, slip = ContactPhase.STICK, ContactPhase.SLIP_FORWARD
    pairs = [(stick, slip), (slip, stick)]
    return tuple(
        PhaseChange(time=t, contact=0, from_phase=pairs[k % 2][0], to_phase=pairs[k % 2][1])
        for k, t in enumerate(times)
    )


def chattering(run, times):
    reason = Reason(
        code="chatter",
        message="the contacts chattered: 100 phase changes within 0.15 s at 0.2 s",
        contact=None,
        time=0.2,
        value=100.0,
        limit=100.0,
        hint="",
    )
    return with_changes(replace(run, outcome=Outcome.CHATTERING, reason=reason), chatter(times))


# The sample


@pytest.mark.parametrize(("population", "count"), [(PAIRS, 60), (ON_BOUNDS, 60)])
def test_random_runs_end_truly(population, count):
    judgements = [
        PLANAR.judge(draw(population, SEED, index), twice=index % 2 == 0) for index in range(count)
    ]
    assert not {index: j for index, j in enumerate(judgements) if j.missed}
    assert len({judgement.outcome for judgement in judgements}) >= 3


# What once went wrong there: a fall, a jump of the law or a pole inside a step, energy lost where
# hands turn fast, contacts that open, estimates that rest on their bounds.
ONCE_WRONG = {
    AT_ENDS: (
        1,
        4,
        10,
        71,
        80,
        92,
        354,
        369,
        1403,
        1711,
        2790,
        3050,
        3361,
        4269,
        4452,
        5399,
        5997,
        8387,
    ),
    ON_BOUNDS: (7, 8, 10, 220, 349, 1126),
}
# Drawn in pairs then; with every new parameter others are drawn. Segments of the motion that last
# no time, extremes of forces near the end of a step.
ONCE_WRONG_IN_PAIRS = sorted((Path(__file__).parent / "once_wrong").glob("planar-*.toml"))


@pytest.mark.parametrize(
    ("population", "index"),
    [(population, index) for population, all_ in ONCE_WRONG.items() for index in all_],
)
def test_runs_that_ended_falsely_once_end_truly(population, index):
    assert not PLANAR.judge(draw(population, 14, index)).missed


@pytest.mark.parametrize("path", ONCE_WRONG_IN_PAIRS, ids=lambda path: path.stem)
def test_runs_drawn_in_pairs_that_ended_falsely_once_end_truly(path):
    assert not PLANAR.judge(load_scenario(path)).missed


def test_random_runs_are_not_materially_different_from_those_of_tight_tolerances():
    comparisons = [compare(draw(ANYWHERE, SEED, index), index) for index in range(25)]
    assert sum(comparison.known for comparison in comparisons) >= 20
    assert not [comparison.number for comparison in comparisons if comparison.is_material]


# Each check can fail


def test_a_run_as_it_should_be_misses_no_check(held):
    assert not missed(held)


def test_chattering_without_its_phase_changes_is_found(held):
    every_ms = 0.2 - 1e-3 * np.arange(100)[::-1]
    assert not missed(chattering(held, every_ms))
    assert missed(chattering(held, every_ms[-99:])) == {"stall"}
    assert missed(chattering(held, np.full(100, 0.2))) == {"stall"}
    assert missed(chattering(held, 0.5 * every_ms - 0.1)) == {"stall"}


def test_phase_changes_that_depend_on_the_output_rate_are_found(held):
    first, *others = held.phase_changes
    later = replace(first, time=first.time + 2e-9)
    assert missed(held, with_changes(held, [later, *others])) == {"rate"}
    assert missed(held, with_changes(held, others)) == {"rate"}


def test_friction_that_gives_back_energy_is_found(held):
    lost = held.trace.dissipated_energy.copy()
    lost[-1] -= 2e-9
    assert missed(with_signal(held, "dissipated_energy", lost)) == {"friction"}


@pytest.mark.parametrize("phase", [ContactPhase.STICK, ContactPhase.SLIP_FORWARD])
def test_a_force_off_its_cone_is_found(held, phase):
    trace = held.trace
    row = np.flatnonzero(trace.phase[:, 0] == phase)[5]
    across = trace.tangential_force.copy()
    bound = trace.friction_coefficient[row, 0] * trace.normal_force[row, 0]
    across[row, 0] = -bound * (1.0 + 1e-8)
    assert missed(with_signal(held, "tangential_force", across)) == {"cone"}


def test_energy_that_is_unaccounted_for_is_found(held):
    supplied = held.trace.supplied_energy.copy()
    supplied[-1] += 2e-6
    assert missed(with_signal(held, "supplied_energy", supplied)) == {"ledger"}


@pytest.mark.parametrize(
    ("metric", "change"),
    [
        ("peak_normal_force", -1e-7),
        ("minimum_friction_margin", 1e-7),
        ("slip_path", -2e-7),
        ("last_slip_time", -1e-3),
        ("slipping_at_end", True),
        ("final_tracking_error", 1e-9),
        ("phase_change_count", 1),
    ],
)
def test_metrics_that_their_trace_exceeds_or_contradicts_are_found(held, metric, change):
    value = getattr(held.metrics, metric)
    wrong = tuple(x + change for x in value) if isinstance(value, tuple) else value + change
    run = replace(held, metrics=replace(held.metrics, **{metric: wrong}))
    assert missed(run) == {"metrics"}


def test_metrics_that_depend_on_the_output_rate_are_found(held):
    effort = held.metrics.torque_effort * (1.0 + 1e-8)
    other = replace(held, metrics=replace(held.metrics, torque_effort=effort))
    assert missed(held, other) == {"metrics"}


def test_completed_runs_that_did_not_reach_their_end_are_found(held):
    assert "completed" in missed(replace(held, trace=held.trace[:-1]))
    joints = held.trace.joint_position.copy()
    joints[3] = np.nan
    assert missed(with_signal(held, "joint_position", joints)) == {"completed"}


@pytest.mark.parametrize("outcome", [Outcome.INCONSISTENT, Outcome.SEPARATED])
def test_ends_are_refused_where_touching_contacts_agree(outcome):
    """Fingers that just hold the object up: nothing forces a contact to open."""
    values = {"simulation.duration": 0.01, "fingers.0.friction": 1.5, "fingers.1.friction": 1.5}
    run = simulate(with_values(load_scenario("composite-case-2"), values))
    reason = Reason(code="any", message="", contact=0, time=0.01, value=None, limit=None, hint="")
    ended = replace(run, outcome=outcome, reason=reason)
    assert set(PLANAR.find_missed(Pair(ended, torques_of(run), ended))) == {outcome.value}


def test_the_friction_of_joints_is_known_where_a_run_ends():
    rough = {f"fingers.{i}.joint_friction": 2.0 for i in range(2)}
    values = {"simulation.duration": 0.1, "trajectory.kind": "circle"} | rough
    run = simulate(with_values(load_scenario("composite-case-2"), values))
    stick = next(a for a in answers_at_end(run, torques_of(run)) if a.phases == (0, 0))
    np.testing.assert_allclose(stick.forces[:, 1], run.trace.normal_force[-1], rtol=1e-8)


def test_a_contact_that_is_let_go_is_found_to_open():
    """Fingers without torque fall from the object that they pressed: no other answer is left."""
    run = simulate(with_values(load_scenario("composite-case-2"), {"simulation.duration": 0.01}))
    answers = [answer.phases for answer in answers_at_end(run, np.zeros((2, 2)))]
    assert answers
    assert all(OPEN in phases for phases in answers)


# Draws and tables


def test_draws_are_the_same_every_time_and_others_for_every_index_and_seed():
    for population in POPULATIONS:
        first = draw(population, SEED, 0)
        assert first == draw(population, SEED, 0)
        assert first != draw(population, SEED, 1)
        assert first != draw(population, SEED + 1, 0)


def test_draws_at_the_ends_of_ranges_lie_there():
    lengths = [
        length
        for index in range(50)
        for finger in draw(AT_ENDS, SEED, index).fingers
        for length in finger.link_lengths
    ]
    ends = np.minimum(np.abs(np.subtract(lengths, 0.7)), np.abs(np.subtract(lengths, 1.2)))
    assert 0.2 < np.mean(ends == 0.0) < 0.5
    assert np.mean(ends < 0.05) > 0.6
    assert 0.7 <= min(lengths) < max(lengths) <= 1.2


def test_processes_judge_the_runs_of_a_campaign_in_order(capsys):
    campaign = judge_many(ON_BOUNDS, 42, SEED)
    assert len(campaign.judgements) == 42
    for index in (0, 41):
        run = draw(ON_BOUNDS, SEED, index)
        assert campaign.judgements[index] == PLANAR.judge(run, twice=index % 2 == 0)
    assert "42 of 42 runs" in capsys.readouterr().err


def test_table_counts_every_check_and_names_its_worst():
    judgements = [
        Judgement("completed", {}),
        Judgement("separated", {"ledger": 2e-6, "rate": 1.0}),
        Judgement("separated", {"ledger": 7e-6}),
    ]
    counts, ends = tabulate([Campaign(AT_ENDS, 1, CHECKS, judgements)])
    found = {row[0]: row[1:] for row in counts.rows}
    assert found[CHECKS["ledger"].text] == ("2", "7e-06 J")
    assert found[CHECKS["rate"].text] == ("1", "–")
    assert "Missed in 2 of 10 checks" in counts.notes[0]
    assert ends.rows == (("`separated`", "66.67 %"), ("`completed`", "33.33 %"))


def test_table_of_truth_names_the_runs_that_miss_it():
    near = {"outcome": 0.0, "end": 0.1, "slip": 0.2, "pose": 0.3}
    comparisons = [Comparison(0, True, near), Comparison(4, True, {**near, "slip": 3.0})]
    table = tabulate_truth(comparisons)
    assert [row[1] for row in table.rows] == ["0", "0", "1", "0"]
    assert "Missed: indices 4" in table.notes[0]


def test_a_seed_is_refused_where_nothing_is_drawn(capsys):
    with pytest.raises(SystemExit) as refusal:
        main(["onset", "--seed", "3"])
    assert refusal.value.code == 2
    assert "--seed N is for outcomes" in capsys.readouterr().err


# Robustness


@pytest.mark.parametrize(("part", "whole"), [(0, 20), (1, 40), (37, 100), (100, 100)])
def test_interval_of_a_share_is_wilson_s(part, whole):
    """Its ends are the fractions from which the sample differs by 1.96 standard deviations."""
    low, high = share_interval(part, whole)
    assert (low == 0.0) == (part == 0) and (high == 1.0) == (part == whole)
    for end in {low, high} - {0.0, 1.0}:
        deviation = np.sqrt(end * (1.0 - end) / whole)
        assert abs(part / whole - end) == pytest.approx(1.959964 * deviation, rel=1e-6)


def test_single_verdicts_of_the_printed_law_change_with_what_should_not_matter():
    rows = measure_outcomes(60).rows
    assert rows[0][2] == "–"
    changed = {words: float(share.split()[0]) for words, _, share in rows[1:]}
    assert changed["steps of 0.5 ms at most"] > 2.0
    assert changed["estimated mass 1e-9 kg larger"] > 2.0


@pytest.mark.parametrize("sweep", SWEEPS)
def test_sweeps_go_on_until_the_composite_law_fails_where_the_oracle_holds(sweep):
    ends = sweep._replace(values=(sweep.values[0], sweep.values[-1]))
    first, last = measure_sweep(ends, 20).rows
    assert first[1][:7] == first[2][:7] == last[2][:7] == "100.0 %"
    # It fails, or the sweep has come to the end of what the setting may be.
    bound = parameter_definitions(load_scenario("composite-case-2"))[sweep.key].maximum
    assert float(last[1].split()[0]) < 75.0 or 1e-3 * sweep.values[-1] == bound


def test_a_velocity_that_jumps_at_an_event_is_found(held):
    velocity = held.trace.object_velocity.copy()
    event = int(np.flatnonzero(np.diff(held.trace.times) == 0.0)[0])
    velocity[event + 1 :, 1] += 1e-3

    assert "velocity" not in missed(held)
    assert "velocity" in missed(with_signal(held, "object_velocity", velocity))
