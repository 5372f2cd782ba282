"""How the kernel is compiled: in units, each apart, the first time on two processors.

A unit is called through its symbol by the others, as with the object files of a C program,
so that the compiler sees every unit once. (Where numba's functions simply call each
other, each is compiled again with each of its callers, which takes minutes here.) Within a
unit, small functions are inlined as usual.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numba
import numpy as np
from llvmlite.binding import add_symbol
from numba import types
from numba.core.caching import FunctionCache
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

from slipgrasp.core.kernel.cache import (
    ROOT_VARIABLE,
    cache_root,
    functions_in_cache,
    in_cache_folder,
)
from slipgrasp.core.kernel.records import Record

_OPTIONS = {"error_model": "numpy", "fastmath": {"contract"}}
_FEW_UNITS = 8
_LOCK = threading.Lock()


@contextmanager
def _nothing_declared_meanwhile() -> Iterator[Any]:
    """Numba's context, which does not look for new declarations; only compiling needs them.

    Looking takes 10 ms for every unit, a third of the time in which the kernel is loaded.
    """
    context = cpu_target.target_context
    # Whoever compiles takes this lock.
    with global_compiler_lock:
        context.refresh = lambda: None
        try:
            yield context
        finally:
            del context.refresh


class _Unit:
    """A function compiled apart; ``entry`` is its machine code once it is loaded."""

    def __init__(self, function: Callable[..., Any], signature: Any) -> None:
        self.function = function
        self.signature = signature
        self.symbol = f"slipgrasp_{function.__name__}"
        self.entry: Callable[..., Any] | None = None

    def compile(self) -> int:
        """Compiles the unit into the cache, unless it is there; returns its address."""
        with in_cache_folder():
            unit = numba.cfunc(self.signature, cache=True, **_OPTIONS)(self.function)
        return int(unit.address or 0)

    def load(self) -> None:
        """Makes the unit ready to be called, from Python and by other units."""
        address = self._find_in_cache() or self.compile()
        add_symbol(self.symbol, address)
        kinds = [_ctype(kind) for kind in self.signature.args]
        prototype = ctypes.CFUNCTYPE(_ctype(self.signature.return_type), *kinds)
        self.entry = prototype(address)

    def _find_in_cache(self) -> int | None:
        """Loads the machine code; None if it is still to be compiled."""
        with in_cache_folder(), _nothing_declared_meanwhile() as context:
            found = FunctionCache(self.function).load_overload(self.signature, context)
        if found is None:
            return None
        name = found.fndesc.llvm_cfunc_wrapper_name
        return int(found.library.get_pointer_to_function(name))


_UNITS: dict[str, _Unit] = {}


def compiled_apart(result: Any, *arguments: Any) -> Callable[[Callable[..., Any]], Any]:
    """Declares a unit with its signature: numba types, or dtypes of records.

    In the kernel the decorated name is called like any function; from Python by `call`.
    """
    kinds = [a if isinstance(a, types.Type) else _record_type(a) for a in arguments]

    def declare(function: Callable[..., Any]) -> Any:
        unit = _Unit(function, result(*kinds))
        assert unit.symbol not in _UNITS, f"two units are called {unit.symbol}"
        _UNITS[unit.symbol] = unit
        return types.ExternalFunction(unit.symbol, unit.signature)

    return declare


@cache
def _record_type(dtype: np.dtype[np.void]) -> types.Type:
    """The type of a record; kept, for numba reads hundreds of fields for each."""
    return numba.from_dtype(dtype)


def compiled(function: Callable[..., Any]) -> Any:
    """Declares a function that is compiled into the units that call it.

    Always inlined: passing the arrays of a record to a function costs more than the call.
    """
    return numba.njit(forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **_OPTIONS)(
        function
    )


@cache
def from_python(function: Any) -> Any:
    """A `compiled` function, to be called from Python."""
    return numba.njit(**_OPTIONS)(function.py_func)


def call(unit: Any, *arguments: Any) -> Any:
    """Calls a unit from Python, without the GIL; loads the kernel first if need be."""
    entry = _UNITS[unit.symbol].entry
    if entry is None:
        prepare_units()
        return call(unit, *arguments)
    return entry(*[_address(a) if isinstance(a, Record) else a for a in arguments])


def prepare_units(report: Callable[[float], None] | None = None) -> None:
    """Loads or compiles all units, each once; safe from any thread.

    Where most must be compiled, a second process starts from the last unit while this one
    starts from the first; what it leaves in the cache is only loaded here.

    Args:
        report: Called with the share of units that are ready, 0 to 1.
    """
    with _LOCK:
        missing = len(_waiting_units())
        second = _start_second_process() if missing > _FEW_UNITS else None
        for unit in _UNITS.values():
            if unit.entry is None:
                if report is not None and missing:
                    report(share_ready())
                unit.load()
        if second is not None:
            second.kill()
            second.wait()


def share_ready() -> float:
    """Share of the units that are loaded or lie compiled on disk, 0 to 1."""
    return 1.0 - len(_waiting_units()) / len(_UNITS)


def _waiting_units() -> list[_Unit]:
    """Units that are still to be compiled."""
    unloaded = [unit for unit in _UNITS.values() if unit.entry is None]
    names = functions_in_cache() if unloaded else set()
    return [unit for unit in unloaded if unit.function.__name__ not in names]


def compile_from_the_end() -> None:
    """What the second process does: compiles units into the cache, the last one first."""
    for unit in _UNITS.values():
        # Nothing is called here: any address satisfies the linker.
        add_symbol(unit.symbol, 1)
    for unit in reversed(_UNITS.values()):
        if unit.function.__name__ not in functions_in_cache():
            unit.compile()


def _start_second_process() -> subprocess.Popen[bytes] | None:
    command = (
        "import slipgrasp.core.kernel.entry; "
        "from slipgrasp.core.kernel.compiler import compile_from_the_end as go; go()"
    )
    path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)
    environment = {**os.environ, "PYTHONPATH": path, ROOT_VARIABLE: str(cache_root())}
    nothing = subprocess.DEVNULL
    try:
        return subprocess.Popen(
            [sys.executable, "-c", command],
            env=environment,
            stdin=nothing,
            stdout=nothing,
            stderr=nothing,
        )
    except OSError:
        return None


_CTYPES = {
    types.int64: ctypes.c_int64,
    types.float64: ctypes.c_double,
    types.void: None,
}


def _ctype(kind: Any) -> Any:
    return ctypes.c_void_p if isinstance(kind, types.Record) else _CTYPES[kind]


def _address(record: Record) -> int:
    """Where a record lies in memory; it must outlive the call."""
    return np.frombuffer(record, np.uint8).ctypes.data
