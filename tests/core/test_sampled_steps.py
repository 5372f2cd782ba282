"""The short steps of sampled control: their methods, their lighter equations, what they share."""

import numpy as np
import pytest

from slipgrasp.core.kernel.compilation.compiler import call
from slipgrasp.core.kernel.compilation.records import make_record
from slipgrasp.core.kernel.numerics import quadratic
from slipgrasp.core.kernel.numerics.methods import BS32, DOPRI5, RK43
from slipgrasp.core.kernel.planar import sticking
from slipgrasp.core.kernel.planar.packing import make_table, pack_model, whole_faces
from slipgrasp.core.kernel.planar.state import STATE
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.core.test_quadratic import pose, random_problem, solve
from tests.each_case import each_case
from tests.references.hands import random_estimates, random_scenario, random_state
from tests.state_evaluation import evaluate_state, from_python

_sticking_acceleration = from_python(sticking.sticking_acceleration)


def order_conditions(method, weights, order):
    """Left sides less right sides of the conditions up to an order (Butcher; HNW I, II.2)."""
    size = int(method["last"]) + 1
    a, c, b = method["matrix"][:size, :size], method["nodes"][:size], weights[:size]
    yield b.sum() - 1.0
    yield b @ c - 1.0 / 2.0
    if order >= 3:
        yield b @ c**2 - 1.0 / 3.0
        yield b @ a @ c - 1.0 / 6.0
    if order >= 4:
        yield b @ c**3 - 1.0 / 4.0
        yield (b * c) @ a @ c - 1.0 / 8.0
        yield b @ a @ c**2 - 1.0 / 12.0
        yield b @ a @ a @ c - 1.0 / 24.0
    if order >= 5:
        yield b @ c**4 - 1.0 / 5.0
        yield b @ a @ a @ a @ c - 1.0 / 120.0


@pytest.mark.parametrize(("method", "order"), [(BS32, 3), (RK43, 4), (DOPRI5, 5)])
def test_methods_of_short_steps_have_their_order_and_an_error_of_the_one_below(method, order):
    last = int(method["last"])
    weights = method["matrix"][last]
    np.testing.assert_allclose(list(order_conditions(method, weights, order)), 0.0, atol=1e-15)
    embedded = weights - method["error"]
    np.testing.assert_allclose(list(order_conditions(method, embedded, order - 1)), 0.0, atol=1e-15)
    assert max(map(abs, order_conditions(method, embedded, order))) > 5e-4


@pytest.mark.parametrize("n", [2, 3, 4])
def test_the_equations_of_sticking_contacts_are_the_general_ones(n):
    rng = np.random.default_rng(n)
    for _ in range(20):
        scenario = random_scenario(rng, n, "masses")
        state = random_state(rng, scenario, (0,) * n)
        estimates, torque = random_estimates(rng, scenario), rng.uniform(-20.0, 20.0, 2 * n)
        general = evaluate_state(scenario, 0.4, *state, (0,) * n, estimates, torque=torque)
        place_of_object, velocity, slip, slip_velocity = map(np.asarray, state)
        assert not slip_velocity.any()
        place, discrete, work = make_record(STATE), make_record(DISCRETE), make_record(WORKSPACE)
        place.x[6 : 6 + n] = slip
        discrete.torques[:n] = torque.reshape(n, 2)
        model = pack_model(make_table(scenario), whole_faces())
        acceleration, power = _sticking_acceleration(
            model, discrete, place, tuple(place_of_object), tuple(velocity), work
        )
        scale = 1.0 + np.abs(general.acceleration[:3]).max()
        np.testing.assert_allclose(
            acceleration, general.acceleration[:3], rtol=0.0, atol=1e-11 * scale
        )
        forces = general.contact_forces
        np.testing.assert_allclose(
            work.forces[:n], forces, rtol=0.0, atol=1e-11 * (1.0 + np.abs(forces).max())
        )
        assert power == pytest.approx(torque @ general.joint_velocities.ravel(), rel=1e-10)


def test_orders_that_change_from_step_to_step_keep_the_tolerance():
    """A hand that knows everything, shaken: rests and fast turns follow each other."""
    scenario = with_values(load_scenario("shake-test"), {"simulation.duration": 2.0})
    usual = simulate(scenario)
    tight = {"simulation.relative_tolerance": 1e-12, "simulation.absolute_tolerance": 1e-14}
    finely = simulate(with_values(scenario, {**tight, "simulation.max_step": 3e-4}))
    np.testing.assert_allclose(
        usual.trace.object_pose[-1], finely.trace.object_pose[-1], rtol=0.0, atol=1e-10
    )
    assert len(usual.phase_changes) == len(finely.phase_changes)
    for one, other in zip(usual.phase_changes, finely.phase_changes, strict=True):
        assert one.time == pytest.approx(other.time, abs=1e-10)


@each_case("seed", range(100))
def test_a_solution_from_the_active_rows_of_the_last_is_the_one_from_none(seed):
    """A problem that changes little from tick to tick, and sometimes all at once."""
    rng = np.random.default_rng([3, seed])
    normals, bounds, equalities = random_problem(rng)
    warm = pose(normals, bounds, equalities)
    warm.warm = 1
    for tick in range(6):
        change = 1.0 if tick == 4 else 1e-3
        normals = normals + change * rng.normal(size=normals.shape)
        point = 10.0 * rng.normal(size=normals.shape[1]) if tick == 4 else None
        if point is not None:
            bounds = normals @ point - rng.exponential(5.0, len(bounds))
        warm.normals[: warm.rows, : warm.columns] = normals
        warm.bounds[: warm.rows] = bounds
        expected = solve(normals, bounds, equalities)
        assert call(quadratic.solve_quadratic, warm) == (expected is not None)
        if expected is not None:
            scale = 1.0 + np.abs(expected).max()
            np.testing.assert_allclose(
                warm.solution[: warm.columns], expected, rtol=0.0, atol=1e-8 * scale
            )
