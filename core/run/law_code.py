"""Calls of a custom law by the kernel: a Python class, or a compiled function.

Both receive the same three named tuples: inputs, memory and outputs. Their fields are NumPy arrays
in the memory of the run, so that a call copies no data. docs/laws.md describes them.
"""

from __future__ import annotations

import ctypes
import traceback
from collections import namedtuple
from collections.abc import Callable, Mapping
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.kernel.compilation.cache import IN_WEBASSEMBLY, INTERPRETED
from slipgrasp.core.kernel.compilation.compiler import require_machine_code
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.run.checked_code import compile_checked, in_python
from slipgrasp.core.scenario.custom_laws import CustomLaw, Diagnostic
from slipgrasp.core.scenario.field_types import FrozenMapping
from slipgrasp.core.trace.ticks import Ticks

FAILED = 1
WORD = 8
_MOST_WORDS = 200  # of type descriptions by numba
_PROTOTYPE = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 3)
_GROUPS = ("model", "parameters")
# Fields of the model of hand and object that a law receives, for planar and spatial hands.
_OF_MODEL = frozenset(
    (
        *("friction", "object_mass", "object_inertia", "object_inertias", "link_masses"),
        *("eccentricity", "link_lengths", "link_centres", "gravity", "torque_limit"),
        *("joint_torque_limit", "joint_minimum", "joint_maximum"),
    )
)
_PER_FINGER = frozenset(
    (
        *("joint_position", "joint_velocity", "joint_torque", "slip", "slip_velocity"),
        *("believed_phase", "slip_direction", "contact_force", "jacobian", "jacobian_inverse"),
        *("link_direction", "contact_arm", "contact_tangent", "contact_tangents"),
        *("contact_normal", "friction", "link_masses", "link_lengths", "link_centres"),
        *("contact_moment", "spin", "spin_velocity", "eccentricity", "weight_torque"),
        *("joint_torque_limit", "joint_minimum", "joint_maximum"),
    )
)

Shape = tuple[int, int]
Entry = Callable[[int, int, int], int]


class LawCode:
    """A law during one run.

    Attributes:
        interrupt: Exception of its code that is not a failure, such as KeyboardInterrupt.
    """

    def __init__(self, law: CustomLaw, own: Record, shape: Shape) -> None:
        """Creates the memory of the law, all zeros, and sets the address of its code in the kernel.

        Args:
            law: The law.
            own: Record of the law in the kernel.
            shape: Numbers of fingers and estimates.

        Raises:
            SlipgraspError: If the kernel runs in WebAssembly, which cannot call the law.
        """
        if IN_WEBASSEMBLY:
            raise SlipgraspError("custom laws need the native kernel: unset SLIPGRASP_KERNEL")
        require_machine_code()
        self.interrupt: BaseException | None = None
        self._failure: str | None = None
        self._refusal: str | None = None
        self._law, self._own, self._shape = law, own, shape
        self._block = np.zeros(max(1, sum(int(np.prod(each)) for each in law.memory.values())))
        self._memory = _memory_views(law, self._block)
        self._out = answer_views(law.diagnostics, own, shape)
        own.memory = self._block.ctypes.data
        command = law.code.__dict__["command"]
        self._compiled = _compiled_part(command)
        if self._compiled is not None and not INTERPRETED:
            self._entry = self._compile()
        else:
            function = law.code().command if self._compiled is None else self._compiled.py_func
            self._entry = _PROTOTYPE(self._guarded(function))
        own.address = _address(self._entry)

    def explain(self) -> str:
        """Describes the failure of the last command, with the line of its code if known."""
        wrong = [n for n, v in self._out._asdict().items() if not np.isfinite(v).all()]
        if self._failure is None and wrong:
            return f"out.{wrong[0]} is not finite: {getattr(self._out, wrong[0]).tolist()}"
        if self._failure is None and self._compiled is not None:
            # Compiled code reports no line: Python finds it by repeating the call.
            with in_python():
                self._guarded(self._compiled.py_func)(0, 0, 0)
        return self._failure or self._refusal or "its compiled code raised an exception"

    def _compile(self) -> Any:
        """Entry point of a compiled law; if numba rejects its code, one that always fails."""
        try:
            return _compiled_entry(self._law, self._compiled, self._own, self._shape)
        except Exception as error:
            self._refusal = f"it cannot be compiled: {_first_reason(error)}"
            return _PROTOTYPE(lambda _seen, _memory, _answer: FAILED)

    def _guarded(self, command: Callable[..., Any]) -> Entry:
        """Wraps a Python function for the kernel; the wrapper returns failures as a number."""
        look, memory, out = seer(self._law, self._own, self._shape), self._memory, self._out

        def entry(_seen: int, _memory: int, _answer: int) -> int:
            try:
                command(look(), memory, out)
            except (Exception, SystemExit) as error:
                self._failure = _describe_failure(error)
                return FAILED
            except BaseException as error:
                self.interrupt = error
                return FAILED
            return 0

        return entry


class Replay:
    """Recorded commands of a run, in place of its law.

    Args:
        ticks: Recorded commands.
        own: Record of the law in the kernel.
        shape: Numbers of fingers and estimates.
    """

    interrupt = None

    def __init__(self, ticks: Ticks, own: Record, shape: Shape) -> None:
        n, p = shape
        table = ticks.to_rows()[:, 1:]
        joints = n * own.answer["torque"].shape[1]
        torque = own.answer["torque"].reshape(-1)[:joints]
        estimates = own.answer["estimates"][:p]
        diagnostics = own.answer["diagnostics"][: table.shape[1] - joints - p]

        def entry(_seen: int, _memory: int, _answer: int) -> int:
            tick = int(own.seen["tick"])
            if tick >= len(table):
                return FAILED
            row = table[tick]
            torque[:] = row[:joints]
            estimates[:] = row[joints : joints + p]
            diagnostics[:] = row[joints + p :]
            return 0

        self._entry = _PROTOTYPE(entry)
        own.address = _address(self._entry)

    def explain(self) -> str:
        """Reason for a missing command."""
        return "the recording has no further command"


def set_parameters(law: CustomLaw | None, values: Mapping[str, float], own: Record) -> None:
    """Sets the parameters of a law; missing ones have their declared defaults."""
    for k, (name, declared) in enumerate(law.parameters.items() if law else ()):
        own.seen["parameters"][k] = values.get(name, declared.value)


def seer(law: CustomLaw, own: Record, shape: Shape) -> Callable[[], Any]:
    """Returns a function that gives the inputs of a law at a tick: array views and numbers."""
    seen, kind = own.seen, own.seen.dtype
    words = np.frombuffer(seen, np.float64)
    own_names, model_names = _names(kind)
    tuple_of, model_of = _tuple("Seen", (*own_names, *_GROUPS)), _tuple("Model", model_names)
    parameters_of = _tuple("Parameters", tuple(law.parameters))
    names: tuple[Any, ...] = (*own_names, *model_names)
    values = [_part(seen[name], name, shape) for name in names]
    places = [k for k, name in enumerate(names) if not kind[name].shape and name != "tick"]
    numbers = [(k, kind.fields[names[k]][1] // WORD) for k in places]
    tick, count = names.index("tick"), len(own_names)
    parameters = seen["parameters"][: len(law.parameters)]

    def look() -> Any:
        for k, word in numbers:
            values[k] = words.item(word)
        values[tick] = int(seen["tick"])
        model = model_of(*values[count:])
        return tuple_of(*values[:count], model, parameters_of(*parameters.tolist()))

    return look


def answer_views(diagnostics: tuple[Diagnostic, ...], own: Record, shape: Shape) -> Any:
    """Outputs of a law.

    ``torque`` ``(n, 2)``, for spatial hands ``(n, 3)``, ``estimates`` ``(p,)``, and each diagnostic
    ``(1,)`` by name.
    """
    names = tuple(each.name for each in diagnostics)
    answer = own.answer
    n, p = shape
    numbers = [answer["diagnostics"][k : k + 1] for k in range(len(names))]
    out = _tuple("Out", ("torque", "estimates", *names))
    return out(answer["torque"][:n], answer["estimates"][:p], *numbers)


def _memory_views(law: CustomLaw, block: Floats) -> Any:
    parts, start = [], 0
    for shape in law.memory.values():
        size = int(np.prod(shape))
        parts.append(block[start : start + size].reshape(shape))
        start += size
    return _tuple("Memory", tuple(law.memory))(*parts)


def _names(seen: np.dtype) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Inputs of a law other than its parameters, and fields of its model."""
    names = [name for name in seen.names or () if name != "parameters"]
    return (
        tuple(name for name in names if name not in _OF_MODEL),
        tuple(name for name in names if name in _OF_MODEL),
    )


@cache
def _tuple(name: str, fields: tuple[str, ...]) -> Any:
    """A class of named tuples, cached by its names, so that compiled code is reused."""
    return namedtuple(name, fields)


def _part(values: Any, name: str, shape: Shape) -> Any:
    """The part of an array of the kernel that a hand uses."""
    count = _used(name, shape)
    return values if count is None else values[:count]


def _used(name: str, shape: Shape) -> int | None:
    """Used lengths of the dimensions of an array, None for all."""
    if name == "estimates":
        return shape[1]
    return shape[0] if name in _PER_FINGER else None


def _address(entry: Any) -> int:
    """Address of machine code from numba, or of a Python function wrapped by ctypes."""
    found = getattr(entry, "address", None)
    return ctypes.cast(entry, ctypes.c_void_p).value or 0 if found is None else int(found)


def _compiled_part(command: Any) -> Any:
    """The function that numba compiles, None if the law is plain Python."""
    function = getattr(command, "__func__", command)
    return function if hasattr(function, "py_func") else None


def _first_reason(error: Exception) -> str:
    """First line of numba's message, with the line in the law's file; omits the long rest."""
    lines = [line for line in str(error).splitlines() if not line.startswith("Failed in")]
    where = next((line for line in lines if line.startswith('File "')), "").rstrip(":")
    return f"{(lines or [''])[0][:_MOST_WORDS]} {where}".strip()


def _describe_failure(error: Exception | SystemExit) -> str:
    """Describes an exception, with the innermost line of the law's code."""
    frames = traceback.extract_tb(error.__traceback__)[1:]
    where = f" ({frames[-1].filename}, line {frames[-1].lineno})" if frames else ""
    own = [frame for frame in frames if "site-packages" not in frame.filename]
    if own:
        where = f" ({own[-1].filename}, line {own[-1].lineno}: {own[-1].line})"
    return f"{type(error).__name__}: {error}{where}"


_ENTRY = """
def entry(seen_at, memory_at, answer_at):
    shown = carray(seen_at, (1,))[0]
    block = carray(memory_at, (1000000,))
    answer = carray(answer_at, (1,))[0]
    status = 0
    # Before the try, in which the compiler would make a block of every slice.
    seen, memory, out = Seen({seen}), Memory({memory}), Out({out})
    try:
        command(seen, memory, out)
    except Exception:
        status = 1
    return status
"""


def _compiled_entry(law: CustomLaw, command: Any, own: Record, shape: Shape) -> Any:
    """Machine code for the kernel, with its address, from a function that numba compiles."""
    names = tuple(each.name for each in law.diagnostics)
    kinds = own.seen.dtype, own.answer.dtype
    own_names, model_names = _names(kinds[0])
    tuples = {
        "Seen": _tuple("Seen", (*own_names, *_GROUPS)),
        "Model": _tuple("Model", model_names),
        "Parameters": _tuple("Parameters", tuple(law.parameters)),
        "Memory": _tuple("Memory", tuple(law.memory)),
        "Out": _tuple("Out", ("torque", "estimates", *names)),
    }
    source = _entry_source(law, own_names, model_names, shape)
    return _compile(command, source, FrozenMapping(tuples), kinds)


@cache
def _compile(
    command: Any, source: str, tuples: Mapping[str, Any], kinds: tuple[np.dtype, np.dtype]
) -> Any:
    """Compiles an entry function; cached within the process, for each kind of hand."""
    numba: Any = import_module("numba")  # has no type stubs
    types = numba.types
    scope = {**tuples, "carray": numba.carray, "command": command}
    exec(source, scope)
    seen, answer = (types.CPointer(numba.from_dtype(kind)) for kind in kinds)
    return compile_checked(scope["entry"], types.int64(seen, types.CPointer(types.float64), answer))


def _entry_source(
    law: CustomLaw, own_names: tuple[str, ...], model_names: tuple[str, ...], shape: Shape
) -> str:
    """Source lines that create the named tuples in compiled code, as Python does with views."""
    parts_seen = {}
    for name in (*own_names, *model_names):
        count = _used(name, shape)
        parts_seen[name] = f"shown.{name}" + ("" if count is None else f"[:{count}]")
    seen = [parts_seen[name] for name in own_names]
    seen.append(f"Model({', '.join(parts_seen[name] for name in model_names)})")
    parameters = (f"shown.parameters[{k}]" for k in range(len(law.parameters)))
    seen.append(f"Parameters({', '.join(parameters)})")
    memory, start = [], 0
    for each in law.memory.values():
        size = int(np.prod(each))
        reshape = "" if len(each) == 1 else f".reshape({each})"
        memory.append(f"block[{start}:{start + size}]{reshape}")
        start += size
    out = [f"answer.torque[:{shape[0]}]", f"answer.estimates[:{shape[1]}]"]
    out += [f"answer.diagnostics[{k}:{k + 1}]" for k in range(len(law.diagnostics))]
    parts = {"seen": seen, "memory": memory, "out": out}
    return _ENTRY.format(**{name: ", ".join(part) for name, part in parts.items()})
