"""How the kernel is compiled, and where the machine code is kept.

The kernel consists of a dozen units. A unit is compiled apart, and others call it through
its symbol, as with the object files of a C program: the compiler sees every function once.
(Where numba's functions simply call each other, each is compiled again with each of its
callers, which takes minutes here.) Within a unit, small functions are inlined as usual.

Numba names a cached function by its own file only, so a caller would keep stale code of a
callee in another file. The cache folder therefore carries a digest of all kernel sources.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import tempfile
import threading
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numpy as np
import platformdirs
from llvmlite.binding import add_symbol
from numba import types
from numba.core import config

from core.kernel.records import Record

__all__ = ["call", "compiled", "compiled_apart", "from_python", "is_cached", "prepare_units"]

_OPTIONS = {"error_model": "numpy", "fastmath": {"contract"}}
_LOCK = threading.Lock()


class _Unit:
    """A function compiled apart; ``entry`` is its machine code once it is loaded."""

    def __init__(self, function: Callable[..., Any], signature: Any) -> None:
        self.function = function
        self.signature = signature
        self.symbol = f"slipgrasp_{function.__name__}"
        self.entry: Callable[..., Any] | None = None

    def load(self) -> None:
        """Loads the machine code from the cache, or compiles it."""
        compiled_unit = _in_cache_folder(
            lambda: numba.cfunc(self.signature, cache=True, **_OPTIONS)(self.function)
        )
        add_symbol(self.symbol, compiled_unit.address)
        kinds = [_ctype(kind) for kind in self.signature.args]
        prototype = ctypes.CFUNCTYPE(_ctype(self.signature.return_type), *kinds)
        self.entry = prototype(compiled_unit.address)


_UNITS: dict[str, _Unit] = {}


def compiled_apart(result: Any, *arguments: Any) -> Callable[[Callable[..., Any]], Any]:
    """Declares a unit with its signature: numba types, or dtypes of records.

    In the kernel the decorated name is called like any function; from Python by `call`.
    """
    kinds = [numba.from_dtype(a) if not isinstance(a, types.Type) else a for a in arguments]

    def declare(function: Callable[..., Any]) -> Any:
        unit = _Unit(function, result(*kinds))
        _UNITS[unit.symbol] = unit
        return types.ExternalFunction(unit.symbol, unit.signature)

    return declare


def compiled(function: Callable[..., Any]) -> Any:
    """Declares a function that is compiled into the units that call it."""
    return numba.njit(no_cpython_wrapper=True, no_cfunc_wrapper=True, **_OPTIONS)(function)


@cache
def from_python(function: Any) -> Any:
    """A `compiled` function, to be called from Python."""
    return numba.njit(**_OPTIONS)(function.py_func)


def call(unit: Any, *arguments: Any) -> Any:
    """Calls a unit from Python, without the GIL; loads the kernel first if need be."""
    entry = _UNITS[unit.symbol].entry
    if entry is None:
        for _ in prepare_units():
            pass
        return call(unit, *arguments)
    return entry(*[_address(a) if isinstance(a, Record) else a for a in arguments])


def prepare_units() -> Iterator[tuple[int, int]]:
    """Loads or compiles all units, each once; yields how many of how many are ready."""
    with _LOCK:
        for done, unit in enumerate(_UNITS.values()):
            if unit.entry is None:
                yield done, len(_UNITS)
                unit.load()


@cache
def cache_folder() -> Path:
    """The user's cache folder, or a temporary one where that cannot be written."""
    root = os.environ.get("SLIPGRASP_CACHE") or platformdirs.user_cache_dir("slipgrasp")
    folder = Path(root) / f"kernel-{_source_digest()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError:
        return Path(tempfile.mkdtemp(prefix="slipgrasp-kernel-"))


def is_cached() -> bool:
    """Whether the kernel is loaded or lies compiled on disk; otherwise it takes a while."""
    if all(unit.entry for unit in _UNITS.values()):
        return True
    names = [path.name for path in cache_folder().rglob("*.nbc")]
    functions = [unit.function.__name__ for unit in _UNITS.values()]
    return all(any(f".{function}-" in name for name in names) for function in functions)


def _source_digest() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _in_cache_folder(compile_it: Callable[[], Any]) -> Any:
    previous = config.CACHE_DIR
    config.CACHE_DIR = str(cache_folder())
    try:
        return compile_it()
    finally:
        config.CACHE_DIR = previous


_CTYPES = {
    types.int64: ctypes.c_int64,
    types.float64: ctypes.c_double,
    types.boolean: ctypes.c_bool,
    types.void: None,
}


def _ctype(kind: Any) -> Any:
    return ctypes.c_void_p if isinstance(kind, types.Record) else _CTYPES[kind]


def _address(record: Record) -> int:
    """Where a record lies in memory; it must outlive the call."""
    return np.frombuffer(record, np.uint8).ctypes.data
