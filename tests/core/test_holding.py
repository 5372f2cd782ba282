"""Every contact inside its cone: what `controller.distribution = "hold"` asks and what follows."""

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.core.test_closed_loop_identities import state_of
from tests.core.test_composite import at_ticks
from tests.references.closed_loop import ClosedLoop
from tests.references.hand import State

CASE_2 = load_scenario("composite-case-2")
THREE = load_scenario("three-fingers")
EVERY_TICK = {"simulation.output_rate": 1000.0, "simulation.duration": 0.05}


def random_state(loop, rng):
    """A state near the start, with every slip velocity in the direction of its phase."""
    n = len(loop.static_friction)
    pose = loop.trajectory.desired(0.0)[0] + rng.normal(0.0, [0.02, 0.02, 0.1])
    phase = rng.choice([-1, 1], n)
    return State(pose, rng.normal(0.0, 0.1, 3), rng.normal(0.0, 0.01, n), np.zeros(n)), phase


def demanded(rng, n):
    """Accelerations asked of the object and of the slips."""
    return np.concatenate((rng.normal(0.0, 2.0, 3), rng.normal(0.0, 2.0, n)))


def asked(loop, kin, friction, v):
    """Torques and contact forces of the law that holds, for believed friction."""
    believed = loop.truth._replace(friction=friction)
    law = loop.law._replace(holds=True)
    return law.command(loop.hand, kin, believed, (0,) * len(friction), v)


@pytest.mark.parametrize("scenario", [CASE_2, THREE], ids=["two", "three"])
def test_the_torque_is_that_of_the_reference_whatever_slips(scenario):
    """At each tick, in stick and in slip: W F = d with every contact inside its cone."""
    values = {"controller.lyapunov_weight": 0.0, "controller.slip_stop": 0.0}
    scenario = with_values(scenario, {**EVERY_TICK, **values})
    trace, loop = simulate(scenario).trace, ClosedLoop.from_scenario(scenario)
    seen = set()
    for row in at_ticks(trace):
        state = state_of(trace, row)
        belief = tuple(trace.believed_phase[row].astype(int))
        estimates = trace.estimates[row]
        desired = loop.trajectory.desired(trace.times[row])
        expected = loop.evaluate(state, belief, estimates, desired).torques
        seen.add(belief)
        np.testing.assert_allclose(np.ravel(trace.joint_torque[row]), expected, atol=2e-6)
    assert len(seen) > 1


@pytest.mark.parametrize("scenario", [CASE_2, THREE], ids=["two", "three"])
@pytest.mark.parametrize("ratio", [1.0, 0.8, 0.3])
def test_one_slip_brakes_at_least_as_hard_as_asked_where_friction_is_not_believed_too_high(
    scenario, ratio
):
    """gamma s'' <= gamma v_s for a belief of at most grip_safety times the truth.

    docs/model.md, Grasp force, has the proof; here the plant of the reference is asked.
    """
    loop, rng = ClosedLoop.from_scenario(scenario), np.random.default_rng(3)
    harder = []
    for _ in range(200):
        state, phase = random_state(loop, rng)
        n = len(phase)
        phase[np.arange(n) != rng.integers(n)] = 0
        kin = loop.hand.kinematics(state)
        v = np.where(np.append([1, 1, 1], phase), demanded(rng, n), 0.0)
        torques, violation, _ = asked(
            loop, kin, ratio * loop.law.grip_safety * loop.truth.friction, v
        )
        if violation > 0.0 or not _is_regular(loop, kin, phase):
            continue
        motion = loop.hand.solve_all_unknowns(kin, loop.truth, tuple(phase), torques, loop.load)
        slip = int(np.flatnonzero(phase)[0])
        excess = phase[slip] * (v[3 + slip] - motion.acceleration[3 + slip])
        assert excess > -1e-9
        harder.append(excess)
    assert len(harder) > 100
    assert np.median(harder) > (1e-3 if ratio < 1.0 else 0.0)


def _is_regular(loop, kin, phase):
    """Whether the plant has an answer that moves as it is pushed (no Painlevé paradox)."""
    reduced = loop.hand.reduced_form(kin, loop.truth, tuple(phase))
    return np.linalg.det(reduced.M) > 0.0


def test_several_slips_brake_as_hard_as_asked_where_none_drives_another():
    """Where no slip gains from the friction of another: gamma_i (M~^-1)_ij gamma_j >= 0."""
    loop, rng, free, driven = ClosedLoop.from_scenario(CASE_2), np.random.default_rng(5), [], []
    for _ in range(300):
        state, phase = random_state(loop, rng)
        kin = loop.hand.kinematics(state)
        v = demanded(rng, 2)
        torques, violation, _ = asked(loop, kin, loop.truth.friction, v)
        if violation > 0.0 or not _is_regular(loop, kin, phase):
            continue
        motion = loop.hand.solve_all_unknowns(kin, loop.truth, tuple(phase), torques, loop.load)
        inverse = np.linalg.inv(loop.hand.reduced_form(kin, loop.truth, tuple(phase)).M)
        alone = np.all(inverse[3:, 3:] * np.outer(phase, phase) >= 0.0)
        (free if alone else driven).append(min(phase * (v[3:] - motion.acceleration[3:])))
    assert len(free) > 50
    assert min(free) > -1e-9
    # The condition is needed.
    assert min(driven) < 0.0


def test_a_false_belief_of_slip_changes_nothing_at_rest():
    """In stick and at rest the torque is the same whatever is believed to slip."""
    loop = ClosedLoop.from_scenario(CASE_2)
    state = State(loop.trajectory.desired(0.0)[0], np.zeros(3), np.zeros(2), np.zeros(2))
    desired = loop.trajectory.desired(0.0)
    estimates = np.append(loop.truth.friction, [1.0, 0.01042])
    torques = [
        loop.evaluate(state, (0, 0), estimates, desired, belief=belief).torques
        for belief in ((0, 0), (1, 0), (1, -1))
    ]
    np.testing.assert_allclose(torques[1:], [torques[0]] * 2, rtol=1e-12)
