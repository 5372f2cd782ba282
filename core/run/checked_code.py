"""Compiled custom laws with bounds checks for every index, as in NumPy.

An index outside its array raises IndexError instead of accessing other memory, in the function and
in all compiled functions that it calls. Numba's option for bounds checks applies to single
functions only, and functions compiled earlier, in this process or in numba's cache on disk, would
be used without checks. This module therefore compiles a checked copy of each function.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

from numba import cfunc, types
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher

from slipgrasp.core.kernel.compilation.compiler import OPTIONS

_CHECKED: dict[str, Any] = {"boundscheck": True}
# In some versions of numba, an exception does not leave a parallel loop.
_OF_TWINS: dict[str, Any] = {**_CHECKED, "parallel": False}


def compile_checked(function: Callable[..., Any], signature: Any) -> Any:
    """Returns the machine code of a Python function, with the attribute ``address``.

    Args:
        function: Function to compile; it may call functions that numba compiles.
        signature: Its numba types.
    """
    with _calls_of_twins():
        return cfunc(signature, **OPTIONS, **_CHECKED)(function)


@contextmanager
def in_python() -> Iterator[None]:
    """A context in which Python executes functions that numba has compiled.

    Compiled code without checks could do the damage that is being diagnosed. Other threads wait for
    compilation meanwhile, and their compiled functions are slower.
    """
    kind: Any = Dispatcher
    with global_compiler_lock:
        kind.__call__ = lambda self, *arguments, **named: self.py_func(*arguments, **named)
        try:
            yield
        finally:
            del kind.__call__


@contextmanager
def _calls_of_twins() -> Iterator[None]:
    """A context in which calls of compiled functions resolve to their checked copies."""
    kind: Any = types.Dispatcher
    before = kind.dispatcher
    with global_compiler_lock:
        kind.dispatcher = property(lambda self: _twin(self._get_object()))
        try:
            yield
        finally:
            kind.dispatcher = before


@cache
def _twin(function: Any) -> Any:
    """Checked copy of a function; functions of numba, which check arguments, are not copied."""
    if function.py_func.__module__.partition(".")[0] == "numba":
        return function
    return type(function)(function.py_func, targetoptions=function.targetoptions | _OF_TWINS)
