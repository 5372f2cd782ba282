"""Fingerprint of the machine code of a function: its bytecode, and everything that it refers to.

Inlined functions contribute their bytecode, functions called through a symbol only their signature.
Comments, docstrings, annotations and line numbers do not contribute.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable
from functools import cache
from types import FunctionType, ModuleType
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core.dispatcher import Dispatcher
from numba.core.registry import cpu_target
from numba.core.types import ExternalFunction

from slipgrasp.core.kernel.compilation.references import code_lines, plain, references_of

_DIGEST_BYTES = 12


def fingerprint(function: Callable[..., Any], signature: Any, options: dict[str, Any]) -> str:
    """Digest of all inputs to the machine code of a function.

    Args:
        function: Python function to compile.
        signature: Its types, including layouts of records.
        options: Options of the compiler.
    """
    digest = hashlib.blake2b(_compiler().encode(), digest_size=_DIGEST_BYTES)
    digest.update(f"{_describe_signature(signature)} {sorted(options.items())}".encode())
    waiting, seen = [function], {function}
    while waiting:
        text, inlined = _describe(waiting.pop())
        digest.update(text)
        waiting += [callee for callee in inlined if callee not in seen]
        seen.update(inlined)
    return digest.hexdigest()


@cache
def _compiler() -> str:
    """Versions of the compiler, and the target processor."""
    target = cpu_target.target_context.codegen().magic_tuple()
    tag = sys.implementation.cache_tag
    return f"{numba.__version__} {llvmlite.__version__} {tag} {target}"


@cache
def _describe(function: FunctionType) -> tuple[bytes, tuple[FunctionType, ...]]:
    """The content of one function, and its inlined functions."""
    lines = [function.__qualname__]
    lines += code_lines(function.__code__, documented=function.__doc__ is not None)
    inlined = []
    for name, value in references_of(function):
        if isinstance(value, Dispatcher):
            inlined.append(plain(value))
            lines.append(f"{name} {sorted(value.targetoptions.items())}")
        elif value is not None:
            lines.append(f"{name} {_describe_value(value)}")
    return "\n".join(lines).encode(), tuple(inlined)


def _describe_value(value: Any) -> str:
    """The compiler's interpretation of a name in a function."""
    if isinstance(value, ModuleType):
        return value.__name__
    if isinstance(value, ExternalFunction):
        return f"{value.symbol} {_describe_signature(value.sig)}"
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {value.tobytes().hex()}"
    if isinstance(value, bool | int | float | str | tuple | np.generic):
        return repr(value)
    # Anything else cannot be compiled: a field of a record happens to have this name.
    return ""


@cache
def _describe_signature(signature: Any) -> str:
    return " ".join(_describe_type(kind) for kind in (signature.return_type, *signature.args))


@cache
def _describe_type(kind: Any) -> str:
    """The name of a type; for a record, a digest of its long layout."""
    text = str(np.dtype(kind.dtype)) if isinstance(kind, numba.types.Record) else str(kind)
    return hashlib.blake2b(text.encode(), digest_size=_DIGEST_BYTES).hexdigest()
