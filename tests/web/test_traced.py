"""Traced numbers: NumPy code run with them gives the formulas of its results."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from slipgrasp.scene import rotations
from slipgrasp.web.standalone.traced import Program, inputs

MATH = SimpleNamespace(
    sqrt=math.sqrt,
    sin=math.sin,
    cos=math.cos,
    abs=abs,
    min=min,
    max=max,
    hypot=math.hypot,
    atan2=math.atan2,
    pow=pow,
)


def evaluated(program, **arrays):
    """The results of a program; its formulas are Python's, too."""
    names = {"Math": MATH, "NaN": math.nan, "Infinity": math.inf, **arrays}
    for name, text in program.statements():
        names[name] = eval(text, names)
    return np.array([eval(text, names) for text in program.outputs])


FUNCTIONS = {
    "sums and products": lambda x: np.stack([x[0] + x[1], x[0] - 2.0 * x[1], x[2] / x[1], -x[0]]),
    "matrices": lambda x: np.outer(x, x) @ x,
    "norms": lambda x: np.linalg.norm(np.stack([x, 2.0 * x]), axis=1),
    "least and largest": lambda x: np.minimum.accumulate(x) + np.maximum(x, 0.3),
    "rotation vectors": lambda x: rotations.from_vectors(x),
    "rotation matrices": lambda x: rotations.matrices(np.append(x, 0.7)),
    "products of rotations": lambda x: rotations.product(
        rotations.from_vectors(x), np.append(x, 1)
    ),
    "angles": lambda x: np.hypot(x[0], x[1:]) + np.arctan2(x[1], x[0]) * np.sin(x[1:]),
    "powers": lambda x: x**2 + np.abs(x) ** 0.5,
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_formulas_give_the_numbers_of_numpy(name):
    program, values = Program(), np.array([0.4, -1.3, 2.2])
    places = program.add(FUNCTIONS[name](inputs("x", 3)))
    found = evaluated(program, x=values)[places]
    assert found == pytest.approx(np.ravel(FUNCTIONS[name](values)), abs=1e-13)


def test_a_rotation_by_nothing_is_none():
    program = Program()
    places = program.add(rotations.from_vectors(inputs("x", 3)))
    assert evaluated(program, x=np.zeros(3))[places].tolist() == [1.0, 0.0, 0.0, 0.0]


def test_what_is_known_to_change_nothing_leaves_no_formula():
    x = inputs("x", 2)
    program = Program()
    program.add(np.eye(2) @ x + 0.0)
    assert not list(program.statements())
    assert program.outputs == ("x[0]", "x[1]")


def test_a_number_is_computed_once():
    x = inputs("x", 1)
    program = Program()
    first, second = program.add(np.sin(x)), program.add(np.sin(x * 1.0))
    assert first == second
    assert len(list(program.statements())) == 1


def test_a_comparison_is_refused():
    x = inputs("x", 2)
    with pytest.raises(TypeError, match="depends on a comparison"):
        np.where(x > 0.0, x, 0.0)
    with pytest.raises(TypeError, match="depends on a comparison"):
        bool(x[0])


def test_javascript_writes_results_in_the_order_that_is_wanted():
    x, program = inputs("x", 2), Program()
    places = program.add(np.stack([x[1], x[0], x[1]]))
    text = program.to_javascript("x", places)
    assert text == "(x,o)=>{o[0]=x[1];o[1]=x[0];o[2]=x[1];}"
