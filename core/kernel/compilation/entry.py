"""Compiles functions to machine code that C and other units can call.

numba's entry for C does not inline the function: it makes a second call, and checks for exceptions,
which units never raise. Here the function is inlined in its entry, and the entry declares that its
records do not overlap (a unit that reads a part of another of its records does not write to that
part) and are all readable.

Loops are neither vectorised nor unrolled by a number that is known only at run time: they have a
few iterations, one per finger, unknown or coordinate, which is less than such a loop needs.
Exceptions are units with loops over the whole state.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

from llvmlite import binding, ir
from numba import _dynfunc, types
from numba.core import config
from numba.core.compiler import Flags, compile_extra
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target

# Attribute of numba for functions with an entry.
ENTRY_OPTIONS: dict[str, Any] = {
    "forceinline": True,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}


class Entry(NamedTuple):
    """Machine code of a function.

    Attributes:
        name: Name of its entry.
        library: numba's library of it.
    """

    name: str
    library: Any

    @property
    def address(self) -> int:
        """Address of the entry in this process."""
        return int(self.library.get_pointer_to_function(self.name))


def compile_entry(
    function: Callable[..., Any], signature: Any, options: dict[str, Any], *, unrolled: bool
) -> Entry:
    """Compiles a function.

    Args:
        function: Python function that raises no exceptions.
        signature: Its numba types.
        options: Options of numba, those of inlined functions.
        unrolled: Whether loops with any number of iterations are unrolled.
    """
    flags: Any = Flags()
    cpu_target.options.parse_as_flags(flags, options | ENTRY_OPTIONS)
    flags.no_compile = True  # before the entry exists
    _unroll_loops(unrolled=False)
    context = cpu_target.target_context
    with (
        global_compiler_lock,
        _replaced(config, "LOOP_VECTORIZE", 0),
        # Each pass prints its types for a log; printing records takes an eighth of it.
        _replaced(types.Record, "__repr__", types.Type.__repr__),
    ):
        with _without_code_of_parts(context):
            result = compile_extra(
                cpu_target.typing_context,
                context,
                function,
                signature.args,
                signature.return_type,
                flags,
                {},
            )
        name = result.fndesc.llvm_cfunc_wrapper_name
        result.library.add_ir_module(_entry_module(context, result.fndesc, name))
        result.library._final_module.get_function(result.fndesc.llvm_func_name).linkage = "internal"
        _unroll_loops(unrolled=unrolled)
        result.library.finalize()
    return Entry(name, result.library)


def _entry_module(context: Any, description: Any, name: str) -> ir.Module:
    """The entry, which calls the function and returns its result."""
    convention, kinds = context.call_conv, description.argtypes
    module = context.create_module(name)
    callee = ir.Function(
        module,
        convention.get_function_type(description.restype, kinds),
        description.llvm_func_name,
    )
    result = context.get_value_type(description.restype)
    entry = ir.Function(
        module, ir.FunctionType(result, [context.get_value_type(kind) for kind in kinds]), name
    )
    for argument, kind in zip(entry.args, kinds, strict=True):
        if isinstance(kind, types.Record):
            argument.add_attribute("noalias")
            argument.attributes.dereferenceable = kind.size
    builder = ir.IRBuilder(entry.append_basic_block())
    _, value = convention.call_function(builder, callee, description.restype, kinds, entry.args)
    builder.ret(value)
    return module


def _unroll_loops(*, unrolled: bool) -> None:
    """Sets whether LLVM unrolls loops: a setting of the whole process."""
    binding.set_option("slipgrasp", f"-unroll-runtime={str(unrolled).lower()}")


@contextmanager
def _without_code_of_parts(context: Any) -> Iterator[None]:
    """A context in which numba generates no machine code of inlined functions: it is never called.

    Numba needs an object in its place, marked as not callable.
    """

    def describe(library: Any, description: Any, environment: Any) -> Any:
        name = description.qualname.split(".")[-1]
        module = description.lookup_module()
        return _dynfunc.make_function(module, name, "inlined", 0, environment, (library,))

    with (
        _replaced(context, "get_executable", describe),
        _replaced(context.codegen(), "_add_module", lambda module: None),
    ):
        yield


@contextmanager
def _replaced(owner: Any, name: str, value: Any) -> Iterator[None]:
    """A context in which an attribute of numba has another value."""
    before = getattr(owner, name)
    setattr(owner, name, value)
    try:
        yield
    finally:
        setattr(owner, name, before)
