"""Premises and bounds of the paper's theorems: Eq. 20, and Eq. 50 to 57 along runs."""

import numpy as np
import pytest
from scipy.integrate import quad_vec, trapezoid
from scipy.linalg import solve_continuous_lyapunov

from slipgrasp.core.run.premises import WINDOW, find_premises, has_premises
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.references.hands import general_gains
from tests.state_evaluation import evaluate_state

# Three fingers, whose torques can do all that is asked, under the law as printed: no bounds, no
# slip stop; friction is believed wrong at slipping contacts.
THREE = with_values(
    load_scenario("three-fingers"),
    {
        "controller.kind": "theorem-4",
        "controller.control_period": 0.0,
        "controller.distribution": "exact",
        "controller.slip_stop": 0.0,
        "simulation.output_rate": 10_000.0,
        "simulation.duration": 0.004,  # then the inertia believed passes zero
        **{f"estimates.{k}.{end}": None for k in range(5) for end in ("minimum", "maximum")},
    },
)
CASE_2 = with_values(load_scenario("paper-case-2"), {"simulation.duration": 0.3})


GENERAL = general_gains(np.random.default_rng(2), 3, 3)


@pytest.fixture(scope="module")
def three_fingers():
    run = simulate(THREE)
    assert run.phase_changes
    return run


@pytest.mark.parametrize("values", [{}, GENERAL], ids=["plain", "gains of the slips, full Q"])
def test_the_lyapunov_value_falls_by_what_the_bound_is_made_of(values):
    """Eq. 52 between the instants at which something jumps."""
    run = simulate(with_values(THREE, values))
    trace, premises = run.trace, find_premises(run)
    assert premises.disturbance.max() > 1.0
    assert (premises.pull > 0.0).all()
    jumps = np.flatnonzero(np.diff(trace.times) == 0.0)
    pieces = np.split(np.arange(len(trace.times)), jumps + 1)
    for rows in (piece for piece in pieces if len(piece) > 5):
        fallen = trace.lyapunov_value[rows[-1]] - trace.lyapunov_value[rows[0]]
        told = trapezoid(premises.decrease[rows], trace.times[rows])
        assert fallen == pytest.approx(told, rel=1e-4)


def test_the_lyapunov_value_is_that_of_the_error(three_fingers):
    """Eq. 56 between its least and greatest eigenvalue, and P from a library's solution."""
    trace, premises = three_fingers.trace, find_premises(three_fingers)
    gain, rate, weight = 100.0, 20.0, 20.0  # of this preset
    a = np.array([[0.0, 1.0], [-gain, -rate]])
    p = solve_continuous_lyapunov(a.T, -weight * np.eye(2))
    ends = np.append(np.linalg.eigvalsh(p), [weight / (2.0 * rate), 1.0 / 1.28])
    assert (trace.lyapunov_value <= ends.max() * premises.error**2 * (1.0 + 1e-9)).all()
    assert (trace.lyapunov_value >= ends.min() * premises.error**2 * (1.0 - 1e-9)).all()


def resting_inertia(pose):
    """M~ of case II where the object rests at a pose, and no fingertip has slipped."""
    zeros, believed = np.zeros(2), [estimate.initial for estimate in CASE_2.estimates]
    return evaluate_state(
        CASE_2, 0.0, pose, np.zeros(3), zeros, zeros, (0, 0), believed
    ).reduced_inertia


def test_eq_20_of_an_object_at_rest_is_the_square_of_one_matrix():
    still = with_values(
        CASE_2, {"trajectory.acceleration": (0.0, 0.0, 0.0), "simulation.duration": 0.2}
    )
    run = simulate(still)
    premises = find_premises(run)
    squares = np.linalg.svd(resting_inertia(still.trajectory.start), compute_uv=False) ** 2
    ready = run.trace.times >= WINDOW
    np.testing.assert_allclose(premises.least_excitation[ready], WINDOW * squares[-1], rtol=1e-9)
    np.testing.assert_allclose(premises.greatest_excitation[ready], WINDOW * squares[0], rtol=1e-9)
    assert np.isnan(premises.least_excitation[~ready]).all()


def test_eq_20_of_a_moving_object_is_a_library_s_integral():
    """Over the last 0.1 s of a lift of 32 mm, to the error of the trapezoidal rule."""
    lifted = with_values(
        CASE_2, {"trajectory.acceleration": (0.0, 4.0, 0.0), "simulation.duration": 0.127}
    )
    run = simulate(lifted)
    premises, end = find_premises(run), run.end_time
    x, y, angle = lifted.trajectory.start

    def square(t):
        matrix = resting_inertia((x, y + 2.0 * t * t, angle))
        return matrix @ matrix.T

    integral, _ = quad_vec(square, end - WINDOW, end, epsrel=1e-10)
    eigenvalues = np.linalg.eigvalsh(integral)
    found = premises.least_excitation[-1], premises.greatest_excitation[-1]
    np.testing.assert_allclose(found, (eigenvalues[0], eigenvalues[-1]), rtol=1e-4)
    at_rest = WINDOW * np.linalg.svd(resting_inertia(lifted.trajectory.start))[1] ** 2
    assert abs(found[1] / at_rest[0] - 1.0) > 1e-3


def test_the_bound_is_empty_while_nothing_is_pulled_back():
    run = simulate(CASE_2)
    premises = find_premises(run)
    assert (premises.pull == 0.0).all()
    assert (premises.least_eigenvalue == 0.0).all()
    assert np.isinf(premises.radius).all()
    assert "gives no bound" in premises.describe()


def test_where_estimates_are_pulled_back_the_radius_has_its_number():
    run = simulate(with_values(CASE_2, {"controller.estimate_norm_bound": 1.2}))
    premises = find_premises(run)
    pulled = premises.pull > 0.0
    assert pulled.any()
    # K* holds Q = 20 I and 2 sigma_s / 1.28.
    expected = np.minimum(20.0, 2.0 * premises.pull[pulled] / 1.28)
    np.testing.assert_allclose(premises.least_eigenvalue[pulled], expected, rtol=1e-12)
    radius = premises.disturbance.max() / expected
    np.testing.assert_allclose(premises.radius[pulled], radius, rtol=1e-12)
    assert "empty" not in premises.describe()
    assert f"{radius.min():.3g}" in premises.describe()


def test_known_friction_and_sticking_contacts_disturb_nothing():
    known = find_premises(simulate(load_scenario("paper-case-1")))
    assert (known.disturbance == 0.0).all()
    run = simulate(CASE_2)
    stuck = (run.trace.phase == 0).all(axis=1)
    assert (find_premises(run).disturbance[stuck] == 0.0).all()


@pytest.mark.parametrize("name", ["composite-case-2", "poured-mass", "wet-patch"])
def test_of_other_laws_and_of_constants_that_change_the_theorems_do_not_speak(name):
    assert not has_premises(load_scenario(name))
