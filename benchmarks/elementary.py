"""Errors of the elementary functions of the kernel, numpy and scipy, relative to mpmath.

``python -m benchmarks.elementary 10000000 [FUNCTION ...]`` tests that many points of every
function, or of the named functions.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numba
import numpy as np
from mpmath import mp
from numpy.typing import NDArray
from scipy.special import ndtri

from benchmarks.report import Table, format_text
from slipgrasp.core.kernel.compilation.compiler import OPTIONS
from slipgrasp.core.kernel.numerics import elementary

POINTS = 100_000

_BLOCK = 100_000
_BITS = 113
_FINER = 1024  # than the smallest positive double

Array = NDArray[np.float64]


class Function(NamedTuple):
    """A function with its references and its points.

    Attributes:
        own: Function of the kernel, for arrays.
        peer: Function of numpy or scipy, for arrays.
        exact: Function of mpmath, for its numbers.
        draw: Returns a number of arguments as arrays, from a generator.
        bound: Largest error that its docstring states [ulp].
        points: Description of the points.
    """

    own: Callable[..., Array]
    peer: Callable[..., Array]
    exact: Callable[..., Any]
    draw: Callable[[np.random.Generator, int], tuple[Array, ...]]
    bound: float
    points: str


class Errors(NamedTuple):
    """Errors over many points.

    Attributes:
        largest: Largest error [ulp].
        missed: Fraction of points at which the result is not the nearest number.
    """

    largest: float
    missed: float

    @property
    def cells(self) -> tuple[str, str]:
        """The errors as cells of a table."""
        return f"{self.largest:.4f}", f"{100.0 * self.missed:.1f} %"


def run(_docs: Path | None = None, count: int = POINTS, names: Sequence[str] = ()) -> list[Table]:
    """The table ``elementary``.

    Args:
        count: Number of points per function.
        names: Names of functions; all by default.
    """
    rows = []
    for name in names or FUNCTIONS:
        function = FUNCTIONS[name]
        own, peer = measure_errors(function, count)
        rows.append((name, function.points, *own.cells, *peer.cells))
    heads = ("function", "points", "largest [ulp]", "not nearest", "numpy [ulp]", "not nearest")
    note = (
        f"{count} random points each; `inverse_normal` is compared with scipy's `ndtri`. numpy and "
        "scipy call the libraries of their builds for this processor."
    )
    return [Table("elementary", heads, tuple(rows), (note,), "portability.md")]


def measure_errors(function: Function, count: int) -> tuple[Errors, Errors]:
    """Errors of a function of the kernel and of its peer.

    Args:
        function: One of `FUNCTIONS`.
        count: Number of points.
    """
    generator = np.random.default_rng(count)
    found = np.empty((2, count))
    for start in range(0, count, _BLOCK):
        block = slice(start, min(start + _BLOCK, count))
        points = function.draw(generator, block.stop - start)
        values = np.stack([function.own(*points), function.peer(*points)])
        found[:, block] = _ulps(values, function.exact, points)
    own, peer = (Errors(float(f.max()), float(np.mean(f > 0.5))) for f in found)
    return own, peer


def _ulps(values: Array, exact: Callable[..., Any], points: tuple[Array, ...]) -> Array:
    """Errors of values ``(m, k)`` at points of k numbers each."""
    near, rest = np.empty((2, len(points[0])))
    with mp.workprec(_BITS):
        for k, arguments in enumerate(zip(*(p.tolist() for p in points), strict=True)):
            truth = exact(*map(mp.mpf, arguments))
            near[k] = truth
            rest[k] = _FINER * (truth - near.item(k))
    ulp = np.spacing(np.abs(near))
    return np.abs((values - near) / ulp - rest / (_FINER * ulp))


def _quantile(share: Any) -> Any:
    """Argument with normal distribution function ``share``: a Newton step from a near value."""
    near = mp.mpf(float(ndtri(float(share))))
    tail = mp.ncdf(near) - share if near < 0 else (1 - share) - mp.ncdf(-near)
    return near - tail / mp.npdf(near)


def _angles(generator: np.random.Generator, count: int) -> tuple[Array]:
    """A third each: small, up to 1000 turns, and next to multiples of a quarter turn."""
    third = count // 3
    small = generator.uniform(-1.0, 1.0, third)
    turning = generator.uniform(-6e3, 6e3, third)
    quarters = np.rint(np.exp(generator.uniform(0.0, 20.0, count - 2 * third)))
    near = 0.5 * np.pi * quarters * (1.0 + generator.uniform(-4e-16, 4e-16, len(quarters)))
    return (np.concatenate([small, turning, near]),)


def _exponents(generator: np.random.Generator, count: int) -> tuple[Array]:
    half = count // 2
    small = generator.uniform(-1.0, 1.0, half)
    return (np.concatenate([small, generator.uniform(-708.0, 709.0, count - half)]),)


def _positive(generator: np.random.Generator, count: int) -> tuple[Array]:
    half = count // 2
    near_one = np.exp(generator.uniform(-1.0, 1.0, half))
    return (np.concatenate([near_one, np.exp(generator.uniform(-700.0, 700.0, count - half))]),)


def _vectors(generator: np.random.Generator, count: int) -> tuple[Array, Array]:
    size = np.exp(generator.uniform(-25.0, 25.0, count))
    return generator.standard_normal(count) * size, generator.standard_normal(count)


def _probabilities(generator: np.random.Generator, count: int) -> tuple[Array]:
    half = count // 2
    tail = np.exp(generator.uniform(-36.0, -0.7, half))
    return (np.concatenate([tail, generator.uniform(0.0, 1.0, count - half)]),)


def _of_one(function: Callable[..., float]) -> Callable[[Array], Array]:
    """A compiled function for arrays."""

    @numba.njit(**OPTIONS)
    def over(x: Array) -> Array:
        values = np.empty_like(x)
        for k in range(x.size):
            values[k] = function(x[k])
        return values

    return over


def _of_two(function: Callable[..., float]) -> Callable[[Array, Array], Array]:
    """A compiled function of two arguments, for arrays."""

    @numba.njit(**OPTIONS)
    def over(y: Array, x: Array) -> Array:
        values = np.empty_like(x)
        for k in range(x.size):
            values[k] = function(y[k], x[k])
        return values

    return over


@numba.njit(**OPTIONS)
def _sine(x: float) -> float:
    return elementary.sincos(x)[0]


@numba.njit(**OPTIONS)
def _cosine(x: float) -> float:
    return elementary.sincos(x)[1]


_ANGLES = "to 1 rad, to 6e3 rad, next to multiples of π/2 to 7e8 rad"
_PARTS = "parts from 1e-11 to 1e11"

FUNCTIONS = {
    "sine": Function(_of_one(_sine), np.sin, mp.sin, _angles, 0.8, _ANGLES),
    "cosine": Function(_of_one(_cosine), np.cos, mp.cos, _angles, 0.8, _ANGLES),
    "exp": Function(_of_one(elementary.exp), np.exp, mp.exp, _exponents, 0.9, "-708 to 709"),
    "log": Function(_of_one(elementary.log), np.log, mp.log, _positive, 0.9, "1e-304 to 1e304"),
    "atan2": Function(_of_two(elementary.atan2), np.arctan2, mp.atan2, _vectors, 0.7, _PARTS),
    "hypot": Function(_of_two(elementary.hypot), np.hypot, mp.hypot, _vectors, 0.501, _PARTS),
    "inverse_normal": Function(
        _of_one(elementary.inverse_normal),
        ndtri,
        _quantile,
        _probabilities,
        8.0,
        "2e-16 to 1 - 1e-16",
    ),
}

if __name__ == "__main__":
    tables = run(count=int(sys.argv[1]), names=sys.argv[2:])
    print("\n\n".join(format_text(table) for table in tables))
