"""The controller's own theory held against the kernel: error equation and Lyapunov function.

Eq. 40 says M~^ L(e) - U phi~ + tau_d = 0 with L(e) = e'' + K_v e' + K_p e. What it equals
exactly is delta of docs/model.md (Lyapunov matrix), the part of the demand that no torque can
produce. Only motion, torque and V come from the kernel, all else from the NumPy reference.
(What follows from it for whole runs is in test_closed_forms.py.)
"""

from functools import cache
from itertools import combinations_with_replacement, pairwise, product
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import simpson

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.each_case import each_case
from tests.references.closed_loop import ClosedLoop
from tests.references.controller import regressor, tracking_errors
from tests.references.hand import State
from tests.references.hands import (
    UNKNOWN_KINDS,
    carrying_hand,
    general_gains,
    random_estimates,
    random_scenario,
    random_state,
)
from tests.state_evaluation import StateEvaluation, evaluate_state

pytestmark = pytest.mark.slow

PHASES = [
    *product((0, 1, -1), repeat=2),
    *combinations_with_replacement((0, 1, -1), 3),
    *combinations_with_replacement((0, 1, -1), 4),
]
SEEDS = range(3)
T = 0.4  # inside the first piece of every desired motion drawn here


def has_enough_actuators(phase):
    """Three coordinates and every slip against two joints per finger."""
    return 3 + np.count_nonzero(phase) <= 2 * len(phase)


class Terms(NamedTuple):
    """What the theory says at one state."""

    residual: np.ndarray  # M~^ L(e) - U phi~ + tau_d of Eq. 40
    delta: np.ndarray  # (I - R)(M~^ v + h~^), R = B~^ B~^+
    demand: np.ndarray  # M~^ v + h~^
    lyapunov_terms: np.ndarray  # the terms of Eq. 49 and 2 delta^T r


def terms(loop, truth, state, phase, estimates, desired, torques, acceleration):
    """Eq. 33, 40, 46 and 49 as printed, with delta and the P of docs/model.md."""
    law, kin = loop.law, loop.hand.kinematics(state)
    estimated = loop.hand.reduced_form(kin, loop.unknowns.fill(estimates), phase)
    v = law.commanded_acceleration(state, phase, desired)
    demand = estimated.M @ v + estimated.h
    delta = demand - estimated.B @ (np.linalg.pinv(estimated.B, rcond=1e-10) @ demand)
    true_input = loop.hand.reduced_form(kin, loop.truth, phase).B
    tau_d = (true_input - estimated.B) @ torques
    U, _ = regressor(loop.hand, kin, loop.unknowns, phase, acceleration)
    error = truth - estimates
    residual = estimated.M @ (v - acceleration) - U @ error + tau_d
    e, e_rate = tracking_errors(state, desired, phase)
    r = law.weighted_errors(estimated, state, phase, desired)
    sigma, weighted = law.leakage(estimates), error / law.adaptation_gain
    # Where K_p is zero, Q weighs only the rate.
    xi = np.append(np.where(law.position_gain > 0.0, e, 0.0), e_rate)
    weight = law.lyapunov_weight
    values = [
        -xi @ (weight if weight.ndim == 2 else np.diag(np.tile(weight, 2))) @ xi,
        -2.0 * sigma * weighted @ error,
        -2.0 * tau_d @ r,
        2.0 * sigma * weighted @ truth,
        2.0 * delta @ r,
    ]
    return Terms(residual, delta, demand, np.array(values))


def true_values(scenario):
    """The true values of the unknowns, ``(p,)``."""
    body, fingers = scenario.object, scenario.fingers
    values = {"object.mass": body.mass, "object.inertia": body.inertia}
    for i, finger in enumerate(fingers):
        values[f"fingers.{i}.friction"] = finger.friction
        for k, mass in enumerate(finger.link_masses):
            values[f"fingers.{i}.link_masses.{k}"] = mass
    return np.array([values[e.parameter] for e in scenario.estimates])


class Point(NamedTuple):
    """A random hand in a random state."""

    scenario: Scenario
    loop: ClosedLoop
    state: State
    estimates: np.ndarray
    kernel: StateEvaluation
    terms: Terms


@cache
def points(phase, unknown):
    """One random hand and state per seed; sigma_s is 0, between 0 and 1, and 1 in turn.

    The last has position gains of the slips and a full Q.
    """
    found = []
    for seed in SEEDS:
        rng = np.random.default_rng([seed, UNKNOWN_KINDS.index(unknown), *(g + 1 for g in phase)])
        scenario = random_scenario(rng, len(phase), unknown)
        estimates = random_estimates(rng, scenario)
        size = max(float(np.linalg.norm(estimates)), 1e-3)
        theorem_3 = seed == 0 and unknown != "friction"
        values = {
            "controller.kind": "theorem-3" if theorem_3 else "theorem-4",
            "controller.estimate_norm_bound": size / (0.5, 1.4, 3.0)[seed],
        }
        if seed == 2:
            values |= general_gains(rng, 3, len(phase))
        scenario = with_values(scenario, values)
        loop = ClosedLoop.from_scenario(scenario)
        state = random_state(rng, scenario, phase)
        kernel = evaluate_state(scenario, T, *state, phase, estimates)
        desired = loop.trajectory.desired(T)
        theory = terms(
            loop,
            true_values(scenario),
            state,
            phase,
            estimates,
            desired,
            kernel.torques,
            kernel.acceleration,
        )
        found.append(Point(scenario, loop, state, estimates, kernel, theory))
    return found


each_phase = each_case("phase", PHASES)
each_unknown = pytest.mark.parametrize("unknown", UNKNOWN_KINDS)


@each_phase
def test_with_nothing_unknown_the_error_obeys_its_own_linear_equation(phase):
    """e'' + K_v e' + K_p e = 0, where there are enough actuators."""
    for p in points(phase, "nothing"):
        v = p.loop.law.commanded_acceleration(p.state, phase, p.loop.trajectory.desired(T))
        off = np.abs(p.kernel.acceleration - v).max()
        # Rounding, magnified by the condition of M~ (up to 1e4 for these hands).
        if has_enough_actuators(phase):
            assert off <= 1e-9 * max(1.0, np.abs(v).max())
        else:
            assert off > 1e-3


@each_phase
@each_unknown
def test_what_no_torque_can_produce_is_all_that_disturbs_the_error_equation(phase, unknown):
    """Eq. 40 with delta on the right, which is zero where there are enough actuators."""
    for p in points(phase, unknown):
        # Rounding of products with M~^, relative to the demand.
        size = max(1.0, float(np.abs(p.terms.demand).max()))
        np.testing.assert_allclose(p.terms.residual, p.terms.delta, rtol=0.0, atol=1e-9 * size)
        if has_enough_actuators(phase):
            np.testing.assert_allclose(p.terms.delta, 0.0, atol=1e-9 * size)
        else:
            assert np.abs(p.terms.delta).max() > 1e-6 * size


def lyapunov_value_after(p, phase, dt):
    """V at the state that uniform acceleration and estimate rates lead to."""
    a, s = p.kernel.acceleration, p.state
    moved = State(
        s.pose + dt * s.velocity + 0.5 * dt**2 * a[:3],
        s.velocity + dt * a[:3],
        s.slip + dt * s.slip_velocity + 0.5 * dt**2 * a[3:],
        s.slip_velocity + dt * a[3:],
    )
    estimates = p.estimates + dt * p.kernel.estimate_rates
    return evaluate_state(p.scenario, T + dt, *moved, phase, estimates).lyapunov_value


@each_phase
@each_unknown
def test_lyapunov_function_changes_at_the_rate_of_the_proof(phase, unknown):
    """At random states, for both theorems and every size of sigma_s."""
    dt = 1e-3
    for p in points(phase, unknown):
        # V is a polynomial of degree 4 along such a motion: this stencil has no error but
        # rounding of V over dt, which the bound below allows 1000 times over.
        ahead, behind = (
            [lyapunov_value_after(p, phase, sign * k * dt) for k in (1, 2)] for sign in (1, -1)
        )
        rate = (8.0 * (ahead[0] - behind[0]) - (ahead[1] - behind[1])) / (12.0 * dt)
        size = max(1.0, float(np.abs(p.terms.lyapunov_terms).max()), ahead[0])
        assert rate == pytest.approx(float(p.terms.lyapunov_terms.sum()), abs=1e-9 * size)


# The estimates of friction are pulled back all the time.
MORE_FINGERS = {
    "simulation.output_rate": 2000.0,
    "simulation.duration": 0.17,
    "controller.estimate_norm_bound": 0.65,
}
SMOOTH = {**MORE_FINGERS, "simulation.output_rate": 1000.0}
CASE_1, CASE_2 = load_scenario("paper-case-1"), load_scenario("paper-case-2")
RUNS = {
    "theorem 3": (CASE_1, {}),
    "theorem 4": (CASE_2, {}),
    "theorem 4 with estimates pulled back": (CASE_2, {"controller.estimate_norm_bound": 1.2}),
    "theorem 4 with unequal friction": (
        CASE_2,
        # The estimate of the inertia runs through zero at 0.043 s and ends the run.
        {"fingers.1.friction": 0.26, "simulation.duration": 0.03},
    ),
    **{f"{n} fingers, theorem 3": (carrying_hand(n, "masses"), SMOOTH) for n in (3, 4)},
    **{f"{n} fingers, theorem 4": (carrying_hand(n, "friction"), MORE_FINGERS) for n in (3, 4)},
}
LOPSIDED = ("theorem 3", "theorem 4 with unequal friction")


def smooth_pieces(trace):
    """Slices of rows between two events."""
    ends = np.flatnonzero(np.diff(trace.times) == 0.0) + 1
    edges = [0, *ends, len(trace)]
    return [slice(a, b) for a, b in pairwise(edges) if b - a > 2]


def state_of(trace, k):
    return State(
        trace.object_pose[k], trace.object_velocity[k], trace.slip[k], trace.slip_velocity[k]
    )


def terms_of_row(loop, truth, trace, k, piece_time):
    """The theory at a stored row; at a corner of the desired motion, that of the given time."""
    return terms(
        loop,
        truth,
        state_of(trace, k),
        tuple(int(gamma) for gamma in trace.phase[k]),
        trace.estimates[k],
        loop.trajectory.desired(float(trace.times[k]), piece_time),
        trace.joint_torque[k],
        np.concatenate((trace.object_acceleration[k], trace.slip_acceleration[k])),
    )


@pytest.mark.parametrize("name", RUNS)
def test_lyapunov_function_of_a_run_is_the_integral_of_its_proof(name):
    """Along a run, while contacts slip and after they have stopped."""
    scenario, values = RUNS[name]
    fine = {"simulation.output_rate": 4000.0, "simulation.duration": 0.15}
    scenario = with_values(scenario, {**fine, **values})
    trace = simulate(scenario).trace
    np.testing.assert_array_equal(trace.believed_phase, trace.phase)
    loop, truth = ClosedLoop.from_scenario(scenario), true_values(scenario)
    largest_delta = 0.0
    for rows in smooth_pieces(trace):
        t = trace.times[rows]
        theory = [
            terms_of_row(loop, truth, trace, k, 0.5 * (t[0] + t[-1]))
            for k in range(rows.start, rows.stop)
        ]
        rates = [float(row.lyapunov_terms.sum()) for row in theory]
        change = trace.lyapunov_value[rows][-1] - trace.lyapunov_value[rows][0]
        assert abs(change) > 1e-4
        # Simpson's rule and the tolerance of the run are better than this, even where the
        # grasp force reaches a limit and the rate has a kink.
        assert change == pytest.approx(simpson(rates, x=t), abs=1e-7)
        delta = max(float(np.abs(row.delta).max()) for row in theory)
        largest_delta = max(largest_delta, delta)
        if has_enough_actuators(trace.phase[rows][0]):
            assert delta < 1e-9
    # Where both sides are equal, the four torques can meet the five demands by symmetry.
    assert (largest_delta > 1e-3) == (name in LOPSIDED)
