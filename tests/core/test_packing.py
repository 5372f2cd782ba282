"""The table of a scenario's numbers, and what the kernel packs from it."""

import math

import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from slipgrasp.core.kernel.planar.packing import make_table, pack_model, whole_faces
from slipgrasp.core.kernel.spatial.model import pack_model as pack_spatial_model
from slipgrasp.core.scenario.loading import load_scenario, preset_names, with_values
from slipgrasp.core.scenario.parameters import describe
from slipgrasp.core.scenario.table import PARTS, TABLE, choices_of, place_of, places
from tests.core.drawn_scenarios import KINDS, draw_scenario
from tests.references.hands import general_gains

SCENARIOS = {name: load_scenario(name) for name in preset_names()}
SCENARIOS |= {"-".join(map(str, kind)): draw_scenario(kind, 0) for kind in KINDS}


def numbers_of(scenario):
    return np.frombuffer(make_table(scenario), np.float64)


def packed(scenario):
    return pack_model(make_table(scenario), whole_faces())


def packed_in_space(scenario):
    return pack_spatial_model(scenario, [0.0] * 6)


def part_of(scenario, key):
    """The class of the part that a parameter belongs to."""
    node = scenario
    for name in key.split(".")[:-1]:
        node = node[int(name)] if name.isdigit() else getattr(node, name)
    return type(node)


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_parameter_that_holds_at_an_instant_stands_at_its_place(name):
    scenario = SCENARIOS[name]
    numbers, told = numbers_of(scenario), 0
    for key, parameter in describe(scenario).items():
        place = place_of(key)
        if key.partition(".")[0] not in PARTS or parameter.kind == "number-or-list":
            continue
        assert place is not None, key
        expected = parameter.value
        if parameter.kind == "choice":
            name = key.rpartition(".")[2]
            expected = choices_of(part_of(scenario, key), name).index(expected)
        elif parameter.kind == "text":
            expected = place_of(expected)
        assert numbers[place] == expected or (expected is None and math.isnan(numbers[place])), key
        told += 1
    assert told > 50


def test_no_two_keys_share_a_place_and_all_places_have_a_key():
    taken = []
    for place in places().values():
        offsets = np.full(place.shape or (1,), place.first)
        for axis, step in enumerate(place.strides):
            shape = [-1 if k == axis else 1 for k in range(len(place.shape))]
            offsets = offsets + step * np.arange(place.shape[axis]).reshape(shape)
        taken += offsets.ravel().tolist()
    assert sorted(taken) == list(range(TABLE.itemsize // 8))


def test_what_stands_nowhere_has_no_place():
    for key in ("title", "pulses.0.time", "fingers.9.friction", "fingers.0.colour"):
        assert place_of(key) is None


def test_the_blocks_of_p_solve_the_lyapunov_equation():
    """Eq. 25 with scipy, coordinate by coordinate; no P > 0 exists where K_p = 0."""
    values = {"controller.position_gain": [40.0, 90.0, 160.0], "controller.velocity_gain": 12.0}
    law = packed(with_values(load_scenario("paper-case-2"), values)).law
    for k in range(3):
        A = np.array([[0.0, 1.0], [-law.position_gains[k], -law.velocity_gains[k]]])
        P = solve_continuous_lyapunov(A.T, -20.0 * np.eye(2))
        blocks = law.lyapunov_11[k], law.lyapunov_12[k], law.lyapunov_22[k]
        np.testing.assert_allclose(blocks, (P[0, 0], P[0, 1], P[1, 1]), rtol=1e-13)
    assert law.lyapunov_11[3] == law.lyapunov_12[3] == 0.0
    assert law.lyapunov_22[3] == pytest.approx(20.0 / (2.0 * 12.0), rel=1e-15)


def matrix_of(law, size):
    """P as it is packed, ``(2 size, 2 size)``."""
    p11, p12, p22 = (np.diag(law[f"lyapunov_{k}"][:size]) for k in ("11", "12", "22"))
    return np.block([[p11, p12], [p12, p22]]) + law.couplings[: 2 * size, : 2 * size]


@pytest.mark.parametrize("pack", [packed, packed_in_space], ids=["plane", "space"])
@pytest.mark.parametrize("seed", range(4))
def test_p_of_a_full_q_solves_the_lyapunov_equation(pack, seed):
    """Eq. 25 with scipy, at gains of all kinds; positions without K_p are left out of xi."""
    rng, in_space = np.random.default_rng(seed), pack is packed_in_space
    scenario = load_scenario("spatial-prism" if in_space else "three-fingers")
    num_poses, n = (6, 6) if in_space else (3, 3)
    size, gains = num_poses + n, rng.uniform(20.0, 200.0, num_poses)
    gains[seed % 3] = 0.0
    values = {
        **general_gains(rng, num_poses, n),
        "controller.position_gain": gains.tolist(),
        "controller.velocity_gain": rng.uniform(5.0, 20.0, size).tolist(),
    }
    scenario = with_values(scenario, values)
    law, Q = pack(scenario).law, np.array(scenario.controller.lyapunov_matrix)
    K_p = np.append(gains, scenario.controller.slip_position_gain)
    np.testing.assert_array_equal(law.position_gains[:size], K_p)
    K_v = np.diag(scenario.controller.velocity_gain)
    A = np.block([[np.zeros((size, size)), np.eye(size)], [-np.diag(K_p), -K_v]])
    kept = np.flatnonzero(np.append(K_p > 0.0, np.full(size, True)))
    part = np.ix_(kept, kept)
    P = matrix_of(law, size)
    expected = solve_continuous_lyapunov(A[part].T, -Q[part])
    np.testing.assert_allclose(P[part], expected, rtol=1e-11, atol=1e-11 * np.abs(P).max())
    assert np.linalg.eigvalsh(P[part])[0] > 0.0
    P[part] = 0.0
    assert (P == 0.0).all()


def test_a_q_that_is_given_in_full_is_that_of_its_weight():
    scenario = load_scenario("paper-case-2")
    full = with_values(scenario, {"controller.lyapunov_matrix": (20.0 * np.eye(10)).tolist()})
    plain, same = packed(scenario).law, packed(full).law
    assert not plain.couples
    assert same.couples
    np.testing.assert_array_equal(matrix_of(same, 5), matrix_of(plain, 5))


@pytest.mark.parametrize("period", [0.0, 0.0005, 0.001, 0.1])
def test_what_is_forgotten_in_a_period_is_a_power_of_the_share_kept_for_a_millisecond(period):
    values = {"controller.control_period": period, "controller.forgetting": 0.9}
    scenario = load_scenario("paper-case-2" if period == 0.0 else "composite-case-2")
    law = packed(with_values(scenario, values)).law
    assert law.forgetting == pytest.approx(0.9 ** (period / 0.001), rel=1e-14)


def test_a_record_that_is_packed_again_is_as_one_that_is_new():
    """Nothing of another scenario is left in it: a page uses one record for all its runs."""
    from slipgrasp.core.kernel.compilation.compiler import call
    from slipgrasp.core.kernel.planar.packing import pack

    for first, second in (("shake-test", "paper-case-1"), ("poured-mass", "shake-test")):
        model = packed(SCENARIOS[first])
        call(pack, make_table(SCENARIOS[second]), whole_faces(), model)
        motion, fresh = model.motion, packed(SCENARIOS[second]).motion
        np.testing.assert_array_equal(motion.breaks, fresh.breaks)
        pieces = int(np.isfinite(fresh.breaks).sum()) + 1
        if not fresh.coasts:
            np.testing.assert_array_equal(motion.polynomials[:pieces], fresh.polynomials[:pieces])
            np.testing.assert_array_equal(motion.angles[:pieces], fresh.angles[:pieces])
            np.testing.assert_array_equal(motion.sine, fresh.sine)
        assert model.law.tobytes() == packed(SCENARIOS[second]).law.tobytes()
