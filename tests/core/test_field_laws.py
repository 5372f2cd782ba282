"""The laws of the field in examples/laws/field.py: what each is made of, and that it does it."""

import importlib.util
from pathlib import Path

import numba
import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import nnls

from slipgrasp import load_law, load_scenario, simulate, verify, with_law, with_values
from slipgrasp.core.run import law_code
from slipgrasp.core.run.checked_code import in_python
from slipgrasp.core.scenario.custom_laws import custom_law, forget

pytestmark = pytest.mark.usefixtures("known_laws")

FILE = Path(__file__).parents[2] / "examples" / "laws" / "field.py"


def _import_file():
    spec = importlib.util.spec_from_file_location("field", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


FIELD = _import_file()


@pytest.fixture
def _interpreted(monkeypatch):
    """Python executes the laws, and what they call: each takes ten seconds to compile."""
    monkeypatch.setattr(law_code, "INTERPRETED", True)
    with in_python():
        yield


def scenario_of(name, duration=1.0):
    law = load_law(f"{FILE}:{name}")
    base = with_law(load_scenario("composite-case-2"), law.name)
    told = {"estimates": [], "controller.grip_force": 10.0, "simulation.duration": duration}
    return with_values(base, told)


def run(name):
    return simulate(scenario_of(name))


def grasp_matrix(arm):
    blocks = [np.array([[1.0, 0.0], [0.0, 1.0], [-y, x]]) for x, y in arm]
    return np.hstack(blocks)


@pytest.mark.usefixtures("_interpreted")
@pytest.mark.parametrize("n", [2, 3, 4, 6])
def test_least_forces_and_internal_forces_are_those_of_the_pseudo_inverse(n):
    rng = np.random.default_rng(n)
    arm, wrench, forces = rng.normal(size=(n, 2)), rng.normal(size=3), rng.normal(size=(n, 2))
    W = grasp_matrix(arm)
    found = np.zeros((n, 2))
    FIELD.add_least_forces(arm, wrench, found)
    np.testing.assert_allclose(found.ravel(), np.linalg.pinv(W) @ wrench, atol=1e-12)
    expected = forces.ravel() - np.linalg.pinv(W) @ W @ forces.ravel()
    FIELD.make_internal(arm, forces)
    np.testing.assert_allclose(forces.ravel(), expected, atol=1e-12)


@pytest.mark.usefixtures("_interpreted")
@pytest.mark.parametrize("n", [2, 3, 4, 6])
@pytest.mark.parametrize("seed", range(5))
def test_the_internal_step_is_that_of_a_librarys_quadratic_program(n, seed):
    """Contacts around a disc, pressed towards its centre: any of them can be pressed harder."""
    rng = np.random.default_rng(seed)
    angles = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False) + 0.1 * rng.normal(size=n) * (n > 2)
    arm = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rows, bounds = np.zeros((n, n, 2)), np.where(rng.random(n) < 0.5, rng.uniform(0, 5, n), 0.0)
    for i in range(n):
        rows[i, i] = -arm[i]
    W, table = grasp_matrix(arm), rows.reshape(n, -1).copy()
    step = np.zeros((n, 2))
    assert FIELD.least_internal_step(arm, rows, bounds, step)
    np.testing.assert_allclose(W @ step.ravel(), 0.0, atol=1e-8)
    assert (table @ step.ravel() >= bounds - 1e-7).all()
    # Lawson and Hanson's least distance problem, in a basis of the null space.
    basis = null_space(W)
    least = np.vstack(((table @ basis).T, bounds))
    multipliers, _ = nnls(least, np.append(np.zeros(basis.shape[1]), 1.0))
    rest = least @ multipliers - np.append(np.zeros(basis.shape[1]), 1.0)
    np.testing.assert_allclose(step.ravel(), basis @ (-rest[:-1] / rest[-1]), atol=1e-7)


@pytest.mark.usefixtures("_interpreted")
def test_an_internal_step_that_the_null_space_lacks_is_refused():
    arm = np.array([[1.0, 0.0], [0.0, 1.0]])  # not opposed: the internal force is along their line
    rows = np.zeros((1, 2, 2))
    rows[0, 0] = [1.0, 1.0]  # across that line
    assert not FIELD.least_internal_step(arm, rows, np.array([1.0]), np.zeros((2, 2)))


@pytest.fixture(scope="module")
def reactive():
    """A run of two opposed fingers; its law takes seconds to compile."""
    result = run("ReactiveForce")
    yield result
    forget(result.scenario.controller.kind)


def test_the_reactive_force_grows_by_its_step_and_pauses(reactive):
    """Under slip: 10 N, then a quarter more at every step of 40 ms."""
    times, (grip, steps) = reactive.ticks.times, reactive.ticks.diagnostics.T
    at = times[np.flatnonzero(np.diff(steps))]
    assert len(at) >= 5
    assert np.all(np.diff(at) > 0.04 - 1e-9)
    np.testing.assert_allclose(grip, 10.0 * 1.25**steps, rtol=0.01)
    assert reactive.metrics.held
    assert verify(reactive).same


def test_the_reactive_force_runs_alike_with_and_without_prediction(reactive):
    """It is not offered to custom laws: the tables of the comparison have no column for it."""
    late = with_values(reactive.scenario, {"controller.latency": 0.03})
    runs = [
        simulate(with_values(late, {"controller.prediction": predicts})).metrics
        for predicts in (False, True)
    ]
    assert runs[0] == runs[1]


@pytest.mark.usefixtures("_interpreted")
def test_learnt_friction_is_the_true_one_after_a_slide_and_sets_the_grip():
    result = run("LearntFriction")
    grip, friction = result.ticks.diagnostics[-1]
    assert np.abs(result.trace.slip).max() > 0.0
    assert friction == pytest.approx(0.25, rel=1e-6)
    load = np.abs(result.trace.tangential_force[-1]).max()
    assert grip == pytest.approx(2.0 * load / 0.25, rel=0.01)
    assert result.metrics.held


@pytest.mark.usefixtures("_interpreted")
def test_the_static_grip_is_what_the_measured_force_needs():
    result = run("ObservedSlip")
    static, dynamic, _ = result.ticks.diagnostics[-1]
    load = np.abs(result.trace.tangential_force[-1]).max()
    assert static == pytest.approx(1.1 * load / 0.25, rel=0.01)
    assert 0.0 <= dynamic <= 10.0
    assert result.metrics.held


@numba.njit
def _squeeze_alone(seen, squeeze, out):
    """In place of `carry`, which `ReactiveForce` compiles too, and longest of all."""
    for i in range(len(seen.slip)):
        for joint in range(2):
            pull = seen.jacobian[i, 0, joint] * squeeze[i, 0]
            pull += seen.jacobian[i, 1, joint] * squeeze[i, 1]
            out.torque[i, joint] = pull


@pytest.mark.parametrize("name", ["LearntFriction", "ObservedSlip"])
def test_a_grip_is_the_same_compiled_and_in_python(name, monkeypatch):
    scenario = scenario_of(name, 0.004)
    law = custom_law(scenario.controller.kind)
    monkeypatch.setitem(law.code.command.py_func.__globals__, "carry", _squeeze_alone)
    told = simulate(scenario).ticks.diagnostics
    assert len(told) == 4
    monkeypatch.setattr(law_code, "INTERPRETED", True)
    with in_python():
        np.testing.assert_array_equal(simulate(scenario).ticks.diagnostics, told)


@pytest.mark.usefixtures("_interpreted")
def test_the_observer_sees_the_slip_of_a_contact_with_bristles():
    """The LuGre model, integrated finely under a load beyond its friction, then below it."""
    mass, most, period, parts = 0.5, 2.0, 1e-3, 100
    v = z = 0.0
    state, covariance, seen, true = np.zeros(2), np.zeros((2, 2)), [], []
    for tick in range(400):
        load = 2.5 if tick < 200 else 1.0
        for _ in range(parts):
            rate = v - FIELD.STIFFNESS * abs(v) * z / most
            friction = FIELD.STIFFNESS * z + FIELD.BRISTLE_DAMPING * v
            v += period / parts * (load - friction) / mass
            z += period / parts * rate
        force = FIELD.STIFFNESS * z + FIELD.BRISTLE_DAMPING * v
        FIELD.observe_slip(state, covariance, force, most, mass, period, 0.01, 10.0)
        seen.append(state[0])
        true.append(v)
    assert true[199] > 0.1
    assert abs(true[-1]) < 0.02 * true[199]
    assert seen[199] > 0.3 * true[199]
    assert abs(seen[-1]) < 0.02 * true[199]
