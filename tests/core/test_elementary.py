"""The kernel's elementary functions: against mpmath, at special values, and bit for bit."""

import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

from benchmarks.elementary import FUNCTIONS, measure_errors, run
from slipgrasp.core.kernel.compilation.compiler import OPTIONS
from slipgrasp.core.kernel.numerics import elementary

REPOSITORY = Path(__file__).parents[2]

SAVE = """
import sys
import numpy as np
from benchmarks.elementary import FUNCTIONS
from tests.core.test_elementary import arguments
np.savez(sys.argv[1], **{name: f.own(*arguments(name)) for name, f in FUNCTIONS.items()})
"""
WAYS = {
    "code for any x86-64": {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": ""},
    "code that is not optimised": {"NUMBA_OPT": "0"},
    "Python": {"SLIPGRASP_KERNEL": "python", "NUMBA_DISABLE_JIT": "1"},
}


@numba.njit(**OPTIONS)
def sincos(x):
    return elementary.sincos(x)


@numba.njit(**OPTIONS)
def nearest(x):
    return elementary.nearest(x)


def arguments(name):
    return FUNCTIONS[name].draw(np.random.default_rng(1), 3000)


def values(name, *arguments):
    return FUNCTIONS[name].own(*np.array(arguments, float)).tolist()


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_error_is_below_the_stated_bound(name):
    own, _ = measure_errors(FUNCTIONS[name], 3000)
    assert own.largest < FUNCTIONS[name].bound


def test_the_table_has_a_row_for_every_function():
    (table,) = run(count=30)
    assert [row[0] for row in table.rows] == list(FUNCTIONS)


@pytest.mark.slow
@pytest.mark.other_code
@pytest.mark.parametrize("way", WAYS)
def test_other_machine_code_and_python_give_the_same_bits(way, tmp_path):
    path = tmp_path / "values.npz"
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY), **WAYS[way]}
    subprocess.run([sys.executable, "-c", SAVE, str(path)], env=environment, check=True)
    with np.load(path) as others:
        for name, function in FUNCTIONS.items():
            own = function.own(*arguments(name))
            np.testing.assert_array_equal(others[name].view(np.int64), own.view(np.int64), name)


def test_sine_and_cosine_of_a_whole_turn_fit_together():
    half = np.linspace(0.0, np.pi, 1001)
    angles = np.concatenate([-half[::-1], half])
    sine, cosine = np.array([sincos(x) for x in angles.tolist()]).T
    np.testing.assert_allclose(sine**2 + cosine**2, 1.0, rtol=0.0, atol=4e-16)
    np.testing.assert_array_equal(sine, -sine[::-1])
    np.testing.assert_array_equal(cosine, cosine[::-1])


def test_the_reduction_does_not_jump_where_it_begins():
    edge = 0.7853981633974483
    below, above = sincos(edge), sincos(np.nextafter(edge, 1.0))
    assert below[0] <= above[0] <= below[0] + 2e-16
    assert below[1] - 2e-16 <= above[1] <= below[1]


def test_what_lies_outside_the_range_is_told():
    assert np.isnan([sincos(x) for x in (2.0**30 * 1.01, np.inf, -np.inf, np.nan)]).all()
    assert values("exp", [-708.1, -np.inf, 709.1, np.inf]) == [0.0, 0.0, np.inf, np.inf]
    assert np.isnan(values("exp", [np.nan])).all()
    assert np.isnan(values("log", [0.0, -1.0, 1e-310, np.inf, np.nan])).all()
    assert np.isnan(values("atan2", [np.nan, 1.0], [1.0, np.nan])).all()
    assert np.isnan(values("hypot", [np.nan, 1.0], [1.0, np.nan])).all()


def test_what_is_exact_comes_out_exact():
    assert sincos(0.0) == (0.0, 1.0)
    assert values("exp", [0.0]) == [1.0]
    assert values("log", [1.0, 2.0, 0.5]) == [0.0, np.log(2.0), -np.log(2.0)]
    assert values("hypot", [3.0, -5.0, 0.0, 0.0], [4.0, 12.0, 0.0, -7.0]) == [5.0, 13.0, 0.0, 7.0]
    assert values("inverse_normal", [0.5]) == [0.0]
    assert [nearest(x) for x in (0.5, 1.5, -2.5, 2.4, -1e9 - 0.6)] == [0, 2, -2, 2, -1e9 - 1]


def test_the_angle_of_a_point_is_right_on_axes_and_diagonals():
    pi = np.pi
    ys, xs = [0, 1, 1, 1, 0, -1, -1, -1, 0], [1, 1, 0, -1, -1, -1, 0, 1, 0]
    angles = [0, pi / 4, pi / 2, 3 * pi / 4, pi, -3 * pi / 4, -pi / 2, -pi / 4, 0]
    assert values("atan2", ys, xs) == angles
