"""Compiles the kernel in separate units, initially on two processors.

Units call each other through symbols, like the object files of a C program, so that each is
compiled once. (If numba's functions called each other directly, each would be compiled again with
each of its callers, which takes minutes.) Within a unit, small functions are inlined. The machine
code of a unit is cached until its fingerprint changes: a change of a control law recompiles only
the one or two units in which it is inlined, a change of a docstring recompiles nothing.

With the environment variable SLIPGRASP_KERNEL=python nothing is compiled: Python runs the kernel,
thousands of times slower but with the same bits, for debuggers and coverage reports. With
SLIPGRASP_KERNEL=webassembly wasmtime runs it. If an installation has the kernel as WebAssembly
(`slipgrasp.core.kernel.webassembly.shipped`), runs start on it while another process compiles.
"""

from __future__ import annotations

import ctypes
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numba
import numpy as np
from llvmlite.binding import add_symbol
from numba import types
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

from slipgrasp.core.kernel.compilation.cache import (
    INTERPRETED,
    ROOT_VARIABLE,
    cache_root,
    code_path,
    only_process,
    read_code,
    write_code,
)
from slipgrasp.core.kernel.compilation.entry import ENTRY_OPTIONS, Entry, compile_entry
from slipgrasp.core.kernel.compilation.fingerprint import fingerprint
from slipgrasp.core.kernel.compilation.records import Record

OPTIONS: dict[str, Any] = {"error_model": "numpy"}
_FEW_UNITS = 2
_BACKGROUND = 10  # niceness of a process that compiles while another engine runs
_KERNEL = "slipgrasp.core.kernel."
_LOCK = threading.Lock()


class Unit:
    """A separately compiled function.

    Attributes:
        entry: Executes the unit; None until it is loaded.
        is_native: Whether ``entry`` is its machine code.
    """

    def __init__(
        self, function: Callable[..., Any], signature: Any, prefix: str, *, unrolled: bool
    ) -> None:
        self.function = function
        self.signature = signature
        self.unrolled = unrolled
        self.symbol = f"slipgrasp_{prefix}{function.__name__}"
        self.entry: Callable[..., Any] | None = None
        self.is_native = False

    @cached_property
    def name(self) -> str:
        """Key of its machine code in the cache."""
        options = OPTIONS | ENTRY_OPTIONS | {"unrolled": self.unrolled}
        digest = fingerprint(self.function, self.signature, options)
        return f"{self.symbol.removeprefix('slipgrasp_')}-{digest}"

    @property
    def is_kept(self) -> bool:
        """Whether its machine code is cached."""
        return code_path(self.name).exists()

    def compile(self) -> Entry:
        """Compiles the unit and caches its machine code."""
        entry = compile_entry(self.function, self.signature, OPTIONS, unrolled=self.unrolled)
        library = entry.library.serialize_using_object_code()
        write_code(self.name, pickle.dumps((entry.name, library)))
        return entry

    def load(self) -> None:
        """Makes the unit callable, from Python and by other units."""
        code = read_code(self.name)
        address = self.compile().address if code is None else _link(code)
        add_symbol(self.symbol, address)
        kinds = [_ctype(kind) for kind in self.signature.args]
        prototype = ctypes.CFUNCTYPE(_ctype(self.signature.return_type), *kinds)
        self.entry, self.is_native = prototype(address), True

    def unload(self) -> None:
        """Makes Python load the unit again; its machine code stays for other units."""
        self.entry, self.is_native = None, False


def _link(code: bytes) -> int:
    """Address of cached machine code."""
    name, library = pickle.loads(code)
    with global_compiler_lock:
        linked = cpu_target.target_context.codegen().unserialize_library(library)
        return int(linked.get_pointer_to_function(name))


# Returns a function that executes a unit in another engine.
Enter = Callable[[Unit], Callable[..., Any]]

_UNITS: dict[str, Unit] = {}
_BACKENDS: list[Callable[[], Enter]] = []
_FIRST: list[Callable[[], Enter]] = []
_DECLARED: dict[Callable[..., Any], tuple[Any, ...]] = {}


def compiled_apart(
    result: Any, *arguments: Any, prefix: str = "", unrolled: bool = False
) -> Callable[[Callable[..., Any]], Any]:
    """Declares a unit with its signature: numba types, or dtypes of records; callees come first.

    In the kernel the decorated name is called like any function; from Python by `call`.

    Args:
        result: Type of the result.
        arguments: Types of the arguments.
        prefix: Prefix of the symbol, if one source is compiled for several mechanics.
        unrolled: Whether loops with any number of iterations are unrolled: those over the state.
    """

    def declare(function: Callable[..., Any]) -> Any:
        _DECLARED[function] = (result, *arguments)
        if INTERPRETED:
            return function
        kinds = [a if isinstance(a, types.Type) else record_type(a) for a in arguments]
        unit = Unit(function, result(*kinds), prefix, unrolled=unrolled)
        assert unit.symbol not in _UNITS, f"two units are called {unit.symbol}"
        _UNITS[unit.symbol] = unit
        return types.ExternalFunction(unit.symbol, unit.signature)

    return declare


def function_of(unit: Any) -> Any:
    """The Python function of a unit, specialised for the objects that its names refer to."""
    symbol = getattr(unit, "symbol", None)
    return _UNITS[symbol].function if symbol in _UNITS else unit


def declared_types(function: Callable[..., Any]) -> tuple[Any, ...]:
    """The declared types of a unit, result first; empty for other functions."""
    return _DECLARED.get(function, ())


@cache
def record_type(dtype: np.dtype[np.void]) -> types.Type:
    """The type of a record; cached, because numba reads hundreds of fields for each."""
    return numba.from_dtype(dtype)


def compiled(function: Callable[..., Any]) -> Any:
    """Declares a function that is compiled into the units that call it.

    Always inlined, because passing the arrays of a record costs more than the call.
    """
    if INTERPRETED:
        return function
    return numba.njit(forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, **OPTIONS)(
        function
    )


def call(unit: Any, *arguments: Any) -> Any:
    """Calls a unit from Python, without the GIL; loads the kernel if necessary."""
    if INTERPRETED:
        with np.errstate(all="ignore"):
            return unit(*arguments)
    entry = _UNITS[unit.symbol].entry
    if entry is None:
        prepare_units()
        return call(unit, *arguments)
    return entry(*[address_of(a) if isinstance(a, Record) else a for a in arguments])


def prepare_units(
    report: Callable[[float], None] | None = None, *, machine_code: bool = False
) -> None:
    """Loads all units, each once; safe for threads and processes.

    Units that are not compiled yet run in the engine of `start_in` meanwhile. Without one they are
    compiled here: a second process starts from the last unit while this one starts from the first;
    units that it has cached are only loaded here.

    Args:
        report: Called with the fraction of ready units, 0 to 1.
        machine_code: Whether other engines are excluded.
    """

    def tell() -> None:
        if report is not None:
            report(_share(_uncompiled_units()))

    with _LOCK:
        if not _uncompiled_units():
            _load_units(lambda: None)
        elif _FIRST and not machine_code:
            _start_elsewhere()
        else:
            with only_process(meanwhile=tell):
                _load_units(tell)


def require_machine_code() -> None:
    """Waits until no unit runs in another engine."""
    if not all(unit.is_native for unit in all_units()):
        prepare_units(machine_code=True)


def _load_units(tell: Callable[[], None]) -> None:
    """Loads every unit, compiling uncached ones; calls ``tell`` before each."""
    if _BACKENDS:
        _enter_units(_BACKENDS[-1]())
        return
    second = None
    if len(_uncompiled_units()) > _FEW_UNITS:
        second = _start_process("compile_from_the_end()")
    for unit in all_units():
        if not unit.is_native:
            tell()
            unit.load()
    if second is not None:
        second.kill()
        second.wait()


def _enter_units(enter: Enter) -> None:
    """Assigns units that are not loaded to another engine."""
    for unit in all_units():
        if unit.entry is None:
            unit.entry = enter(unit)


def _start_elsewhere() -> None:
    """Runs units in another engine until their machine code is available."""
    if all(unit.entry for unit in all_units()):
        return
    _enter_units(_FIRST[-1]())
    threading.Thread(target=_go_over, daemon=True).start()


def _go_over() -> None:
    """Compiles in another process, which may outlive this one; then the machine code is loaded.

    The engine may change during a run, because each call has all its data in its arguments.
    """
    with only_process(meanwhile=lambda: None):
        if _uncompiled_units():
            process = _start_process("compile_all()", outlives=True)
            if process is not None:
                process.wait()
    prepare_units(machine_code=True)


def choose_backend(make: Callable[[], Enter]) -> None:
    """Selects another engine for units that are loaded later.

    Args:
        make: Returns the argument of `entered_by`, when units are needed.
    """
    _BACKENDS.append(make)


def start_in(make: Callable[[], Enter]) -> None:
    """Selects another engine for units until their machine code is available.

    Args:
        make: Returns the argument of `entered_by`, when units are needed.
    """
    _FIRST.append(make)


def share_ready(*, machine_code: bool = False) -> float:
    """Fraction of units that can run without being compiled, 0 to 1.

    Args:
        machine_code: Whether other engines are excluded.
    """
    return 1.0 if _FIRST and not machine_code else _share(_uncompiled_units())


def _share(missing: list[Unit]) -> float:
    return 1.0 - len(missing) / max(len(_UNITS), 1)


def _uncompiled_units() -> list[Unit]:
    """Units without machine code, unless a chosen engine runs them."""
    ready = "entry" if _BACKENDS else "is_native"
    return [unit for unit in all_units() if not (getattr(unit, ready) or unit.is_kept)]


def all_units() -> tuple[Unit, ...]:
    """All declared units, callees first."""
    return tuple(_UNITS.values())


@contextmanager
def entered_by(enter: Enter) -> Iterator[None]:
    """A context in which another engine runs the kernel's units.

    Args:
        enter: Returns the replacement of a unit, called with addresses of records and numbers.
    """
    prepare_units()
    before = {unit: unit.entry for unit in all_units()}
    try:
        for unit in before:
            unit.entry = enter(unit)
        yield
    finally:
        for unit, entry in before.items():
            unit.entry = entry


def kept_code() -> list[Path]:
    """Files of the cached units."""
    return [code_path(unit.name) for unit in _UNITS.values() if unit.is_kept]


def compile_all() -> None:
    """Main function of a process that compiles all units into the cache."""
    if hasattr(os, "nice"):  # not on Windows
        os.nice(_BACKGROUND)
    _load_units(lambda: None)


def only_compile() -> None:
    """Lets this process compile units in any order, and call none of them."""
    for unit in all_units():
        # Any address satisfies the linker.
        add_symbol(unit.symbol, 1)


def compile_from_the_end() -> None:
    """Main function of the second process: compiles units into the cache, the last one first."""
    only_compile()
    for unit in reversed(_UNITS.values()):
        if not unit.is_kept:
            unit.compile()


def _start_process(command: str, *, outlives: bool = False) -> subprocess.Popen[bytes] | None:
    """Starts a process that declares the same units.

    Args:
        command: A call of a function of this module.
        outlives: Whether it continues after this process has ended.
    """
    # A unit may be declared in another module than its function.
    modules = ", ".join(name for name in sys.modules if name.startswith(_KERNEL))
    code = f"import {modules}; from {__name__} import *; {command}"
    path = os.pathsep.join(entry or os.getcwd() for entry in sys.path)
    environment = {**os.environ, "PYTHONPATH": path, ROOT_VARIABLE: str(cache_root())}
    nothing = subprocess.DEVNULL
    try:
        return subprocess.Popen(
            [sys.executable, "-c", code],
            env=environment,
            stdin=nothing,
            stdout=nothing,
            stderr=nothing,
            start_new_session=outlives,
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


def address_of(record: Record) -> int:
    """Address of a record, which must outlive the call."""
    return np.frombuffer(record, np.uint8).ctypes.data
