"""Numbers that record their computation, so that it can be repeated in JavaScript.

NumPy code called with arrays of these numbers returns the formulas of its results instead of
values. `Program` writes them as JavaScript, so that a page uses the code of the scene and the
charts. Comparisons of traced numbers raise an error, because the resulting formula would be valid
for some values only.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

_INFIX = "+-*/"


class Number:
    """A number whose value is not yet known: an operation and its operands.

    Args:
        operation: An operator, the name of a function of JavaScript's ``Math``, or "" for an input.
        operands: Numbers, traced or not; for an input, its text.
    """

    __slots__ = ("operands", "operation")

    def __init__(self, operation: str, *operands: Any) -> None:
        self.operation, self.operands = operation, operands

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """Applies a function of NumPy to single numbers."""
        # The operators of NumPy scalars would call this method again.
        plain = [each.item() if isinstance(each, np.generic) else each for each in inputs]
        arrays = [np.asarray(each, dtype=object).view(Traced) for each in plain]
        result = getattr(ufunc, method)(*arrays, **options)
        return result.item() if isinstance(result, np.ndarray) and result.ndim == 0 else result

    def __bool__(self) -> bool:
        """Raises TypeError."""
        raise TypeError("what depends on a comparison cannot be traced")

    def _compare(self, _other: object) -> bool:
        raise TypeError("what depends on a comparison cannot be traced")

    __lt__ = __le__ = __gt__ = __ge__ = _compare

    def __add__(self, other: Any) -> Any:
        return _made("+", self, other)

    def __radd__(self, other: Any) -> Any:
        return _made("+", other, self)

    def __sub__(self, other: Any) -> Any:
        return _made("-", self, other)

    def __rsub__(self, other: Any) -> Any:
        return _made("-", other, self)

    def __mul__(self, other: Any) -> Any:
        return _made("*", self, other)

    def __rmul__(self, other: Any) -> Any:
        return _made("*", other, self)

    def __truediv__(self, other: Any) -> Any:
        return _made("/", self, other)

    def __rtruediv__(self, other: Any) -> Any:
        return _made("/", other, self)

    def __neg__(self) -> Any:
        return _made("-", 0.0, self)

    def __pow__(self, exponent: Any) -> Any:
        if _is(exponent, 2.0):
            return self * self
        return Number("pow", self, exponent)

    def __abs__(self) -> Any:
        return Number("abs", self)

    def __round__(self, _digits: int | None = None) -> Any:
        return self

    def conjugate(self) -> Any:
        """Returns the number itself, which is real."""
        return self

    def sqrt(self) -> Any:
        """Returns the square root."""
        return Number("sqrt", self)

    def sin(self) -> Any:
        """Returns the sine."""
        return Number("sin", self)

    def cos(self) -> Any:
        """Returns the cosine."""
        return Number("cos", self)


def _made(operation: str, a: Any, b: Any) -> Any:
    """Result of an operator, simplified for operands that are known to be 0 or 1."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return NotImplemented
    nothing = 0.0 if operation in "+-" else 1.0
    if _is(b, nothing) or (operation == "+" and _is(a, nothing)):
        return a if _is(b, nothing) else b
    if operation == "*" and _is(a, 1.0):
        return b
    if (operation == "*" and (_is(a, 0.0) or _is(b, 0.0))) or (operation == "/" and _is(a, 0.0)):
        return 0.0
    return Number(operation, a, b)


def _is(value: Any, constant: float) -> bool:
    return not isinstance(value, Number) and value == constant


def _two(name: str, known: Callable[[Any, Any], Any]) -> Any:
    """A function of two numbers as a NumPy ufunc."""

    def apply(a: Any, b: Any) -> Any:
        traced = isinstance(a, Number) or isinstance(b, Number)
        return Number(name, a, b) if traced else known(a, b)

    return np.frompyfunc(apply, 2, 1)


_FUNCTIONS: dict[Any, Any] = {
    np.minimum: _two("min", min),
    np.maximum: _two("max", max),
    np.hypot: _two("hypot", math.hypot),
    np.arctan2: _two("atan2", math.atan2),
}
"""Functions for which objects have no method."""


class Traced(np.ndarray):
    """An array of traced numbers."""

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """Applies a NumPy function element by element."""
        plain = [each.view(np.ndarray) if isinstance(each, Traced) else each for each in inputs]
        outputs = [each.view(np.ndarray) for each in options.pop("out", ())]
        if outputs:
            options["out"] = tuple(outputs)
        result = getattr(_FUNCTIONS.get(ufunc, ufunc), method)(*plain, **options)
        return result.view(Traced) if isinstance(result, np.ndarray) else result

    def __array_function__(
        self, function: Any, types: Any, arguments: Iterable[Any], options: Mapping[str, Any]
    ) -> Any:
        """Applies a composite NumPy function."""
        own = {np.sinc: _sinc, np.linalg.norm: _norm}.get(function)
        if own is not None:
            return own(*arguments, **options)
        result = super().__array_function__(function, types, arguments, options)
        is_traced = isinstance(result, np.ndarray) and result.dtype == object
        return result.view(Traced) if is_traced else result

    def astype(self, dtype: Any, *_arguments: Any, **_options: Any) -> Any:
        """Returns the array itself, or converts known numbers to integers."""
        return self if np.issubdtype(dtype, np.floating) else np.array(self.tolist(), dtype)


def inputs(name: str, count: int) -> Traced:
    """Traced input numbers: items of an array of this name."""
    return np.array([Number("", f"{name}[{k}]") for k in range(count)], dtype=object).view(Traced)


class Program:
    """Formulas as statements; each is computed once.

    Attributes:
        outputs: Texts of the results, by index.
    """

    def __init__(self) -> None:
        self._names: dict[str, str] = {}
        self._known: dict[int, tuple[Any, str]] = {}
        self._places: dict[str, int] = {}

    def add(self, values: NDArray[Any]) -> list[int]:
        """Adds numbers to the outputs and returns their indices."""
        texts = [self._text(value) for value in np.asarray(values, dtype=object).ravel().tolist()]
        return [self._places.setdefault(text, len(self._places)) for text in texts]

    @property
    def outputs(self) -> tuple[str, ...]:
        """Texts of the results, by index."""
        return tuple(self._places)

    def statements(self) -> Iterator[tuple[str, str]]:
        """Names and formulas, in the order of computation."""
        return ((name, text) for text, name in self._names.items())

    def to_javascript(self, parameters: str, order: Sequence[int] = ()) -> str:
        """A function of arrays that writes results into an array ``o``.

        Args:
            parameters: Names of the input arrays.
            order: Indices of the results in output order; all if empty.
        """
        lines = [f"const {name}={text};" for name, text in self.statements()]
        written = [self.outputs[place] for place in order] or self.outputs
        lines += [f"o[{k}]={text};" for k, text in enumerate(written)]
        return f"({parameters},o)=>{{{''.join(lines)}}}"

    def _text(self, value: Any) -> str:
        if not isinstance(value, Number):
            return _constant(float(value))
        known = self._known.get(id(value))
        if known is None:
            # The number is also stored, so that its identity is not reused.
            known = self._known[id(value)] = value, self._make(value)
        return known[1]

    def _make(self, value: Number) -> str:
        if not value.operation:
            return value.operands[0]
        operands = [self._text(each) for each in value.operands]
        if value.operation in _INFIX:
            text = value.operation.join(operands)
        else:
            text = f"Math.{value.operation}({','.join(operands)})"
        return self._names.setdefault(text, f"v{len(self._names)}")


def _constant(value: float) -> str:
    if math.isnan(value):
        return "NaN"
    if math.isinf(value):
        return "Infinity" if value > 0.0 else "(-Infinity)"
    return repr(value) if math.copysign(1.0, value) > 0.0 else f"({value!r})"


def _norm(x: Any, axis: int | None = None, keepdims: bool = False) -> Any:
    return np.sqrt((x * x).sum(axis=axis, keepdims=keepdims))


def _sinc(x: Any) -> Any:
    """sin(pi x) / (pi x); a tiny offset gives 1 at 0."""
    y = np.hypot(np.pi * x, _TINY)
    return np.sin(y) / y


_TINY = 1e-20
