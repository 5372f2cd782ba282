"""Machine code of a custom law in which every index is checked, as NumPy checks it.

An index outside its array raises IndexError instead of reading or writing the memory beside it:
in the function itself and in all compiled functions that it calls. Numba checks on request, but
each function by its own options, and functions that have been compiled before, in this process or
by numba's own cache on disk, would be taken as they are; so each has a checked twin here.
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
# An exception in a parallel loop does not leave it in every version of numba.
_OF_TWINS: dict[str, Any] = {**_CHECKED, "parallel": False}


def compile_checked(function: Callable[..., Any], signature: Any) -> Any:
    """Machine code of a plain Python function, with the attribute ``address``.

    Args:
        function: What other code calls; it may call functions that numba compiles.
        signature: Its numba types.
    """
    with _calls_of_twins():
        return cfunc(signature, **OPTIONS, **_CHECKED)(function)


@contextmanager
def in_python() -> Iterator[None]:
    """Within it Python runs what numba has compiled, where it is called from Python.

    Compiled code without checks could do the harm that is looked for. Other threads wait for
    compilers meanwhile, and what they call themselves is slower.
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
    """Numba asks the type of a compiled function for it: within this, that is its twin."""
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
    """The same function with checks; numba's own, which check what they are given, stay."""
    if function.py_func.__module__.partition(".")[0] == "numba":
        return function
    return type(function)(function.py_func, targetoptions=function.targetoptions | _OF_TWINS)
