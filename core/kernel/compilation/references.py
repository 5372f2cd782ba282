"""References of a function by name, independent of numba's representation.

Shared by the fingerprints of machine code (`slipgrasp.core.kernel.compilation.fingerprint`) and the
name of the numerics (`slipgrasp.core.kernel.compilation.normal_form`).
"""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from functools import cached_property
from types import CodeType, FunctionType
from typing import Any

from numba.core.dispatcher import Dispatcher


def names_known_to(function: FunctionType) -> dict[str, Any]:
    """Values of the names that a function uses from its module and enclosing functions."""
    cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    return {**function.__globals__, **{name: cell.cell_contents for name, cell in cells}}


def references_of(function: FunctionType) -> Iterator[tuple[str, Any]]:
    """Every name in a function's code that has a value, in the order of its code.

    A field of a record with the name of another object is included too.
    """
    known = names_known_to(function)
    for code in _codes(function.__code__):
        for name in (*code.co_names, *code.co_freevars):
            if name in known:
                yield name, known[name]


def _codes(code: CodeType) -> Iterator[CodeType]:
    """A code object and those of the functions inside it."""
    yield code
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _codes(constant)


def code_lines(code: CodeType, *, documented: bool) -> Iterator[str]:
    """The parts of a code object that determine its behaviour; not its docstring."""
    yield f"{code.co_argcount} {code.co_names} {code.co_varnames} {code.co_code.hex()}"
    for constant in code.co_consts[1 if documented else 0 :]:
        if isinstance(constant, CodeType):
            yield from code_lines(constant, documented=False)
        else:
            yield repr(constant)


def plain(value: Any) -> Any:
    """The Python function inside a wrapper; other objects are returned unchanged."""
    if isinstance(value, Dispatcher):
        return value.py_func
    if isinstance(value, property):
        return value.fget
    if isinstance(value, staticmethod | classmethod):
        return value.__func__
    if isinstance(value, cached_property):
        return value.func
    return inspect.unwrap(value) if callable(value) else value
