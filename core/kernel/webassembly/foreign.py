"""Runs the compiled kernel in another engine: WebAssembly, in wasmtime or elsewhere.

It replaces the kernel for Python, by `compiler.entered_by`, or, for a whole process, by the
environment variable SLIPGRASP_KERNEL=webassembly, which needs the extra ``wasm``.
"""

from __future__ import annotations

import ctypes
import threading
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from numba import types

from slipgrasp.core.kernel.compilation.compiler import Unit
from slipgrasp.core.kernel.loop.progress import TICKS_BEFORE_PAUSE
from slipgrasp.core.trace.frames import import_optional

_LINE, _PAGE = 64, 65536
_WORD = 8

Block = tuple[int, bytes]
Span = tuple[int, int]


class Copy(NamedTuple):
    """A block of memory, its address in this process and in the engine, and its size [bytes]."""

    here: int
    there: int
    size: int


class ForeignKernel(ABC):
    """Copies records into the memory of another engine, runs a unit there, and copies them back.

    Only the used parts of output buffers are copied: whole buffers would take a hundred times as
    long as a run. Calls from several threads wait for each other.
    """

    def __init__(self) -> None:
        self._places: dict[tuple[types.Record, int], int] = {}
        self._end = self.heap()
        self._lock = threading.Lock()

    @abstractmethod
    def heap(self) -> int:
        """Address of the start of free memory."""

    @abstractmethod
    def grow(self, size: int) -> None:
        """Grows the memory to at least this size [bytes]."""

    @abstractmethod
    def perform(
        self,
        symbol: str,
        writes: Sequence[Block],
        arguments: Sequence[Any],
        longs: Sequence[bool],
        reads: Sequence[Span],
    ) -> tuple[Any, list[bytes]]:
        """Writes blocks, calls a function, and reads spans of memory.

        Args:
            symbol: Name of the function.
            writes: Addresses and contents.
            arguments: Numbers, and addresses in place of records.
            longs: Whether each argument is a 64-bit integer.
            reads: Addresses and sizes.
        """

    @abstractmethod
    def read(self, at: int, size: int) -> bytes:
        """Reads a part of the memory."""

    def enter(self, unit: Unit) -> Callable[..., Any]:
        """The replacement of a unit, called with addresses of records and numbers."""
        kinds = unit.signature.args
        longs = [kind is types.int64 for kind in kinds]

        def call(*arguments: Any) -> Any:
            with self._lock:
                return self._call(unit.symbol, kinds, longs, arguments)

        return call

    def place(self, kind: types.Record, which: int = 0) -> int:
        """Address of the records of one kind; of a second one in a call with ``which`` = 1."""
        key = (kind, which)
        if key not in self._places:
            self._places[key] = -(-self._end // _LINE) * _LINE
            self._end = self._places[key] + kind.size
            self.grow(self._end)
        return self._places[key]

    def _call(
        self, symbol: str, kinds: Sequence[Any], longs: Sequence[bool], arguments: Sequence[Any]
    ) -> Any:
        there, seen = list(arguments), Counter[Any]()
        spans: list[Copy] = []
        outputs: list[_Output] = []
        for k, here in _records(kinds, arguments):
            kind = kinds[k]
            there[k] = self.place(kind, seen[kind])
            seen[kind] += 1
            if "num_rows" in kind.fields:
                outputs.append(_Output(kind, here, there[k]))
                spans += outputs[-1].counts()
            else:
                spans.append(Copy(here, there[k], kind.size))

        def used() -> list[Copy]:
            row = max(_row_length(kinds[k], here) for k, here in _records(kinds, arguments))
            return [span for output in outputs for span in output.contents(row)]

        given = [*spans, *used()] if outputs else spans
        writes = [(each.there, ctypes.string_at(each.here, each.size)) for each in given]
        reads = [(each.there, each.size) for each in spans]
        result, contents = self.perform(symbol, writes, there, longs, reads)
        for each, content in zip(spans, contents, strict=True):
            ctypes.memmove(each.here, content, each.size)
        for each in used() if outputs else ():
            ctypes.memmove(each.here, self.read(each.there, each.size), each.size)
        return result


class _Output(NamedTuple):
    """The output of a run, whose buffers are partly used.

    Attributes:
        kind: Its type.
        here: Its address in this process.
        there: Its address in the engine.
    """

    kind: types.Record
    here: int
    there: int

    def counts(self) -> Iterator[Copy]:
        """The parts outside its buffers."""
        rows, ticks = (self.kind.fields[name].offset for name in ("rows", "num_ticks"))
        yield Copy(self.here, self.there, rows)
        yield Copy(self.here + ticks, self.there + ticks, _WORD)

    def contents(self, row: int) -> Iterator[Copy]:
        """The used parts of its buffers.

        Args:
            row: Numbers per row; 0 for a run without rows, whose counts may not be set yet.
        """
        if row == 0:
            return
        tick = self.kind.fields["ticks"].type.shape[0] // (TICKS_BEFORE_PAUSE + 1)
        for name, length in (("rows", row), ("ticks", tick)):
            count = _long(self.here + self.kind.fields[f"num_{name}"].offset)
            offset = self.kind.fields[name].offset
            if count * length:
                yield Copy(self.here + offset, self.there + offset, _WORD * count * length)


def _records(kinds: Sequence[Any], arguments: Sequence[Any]) -> Iterator[tuple[int, int]]:
    """Indices of the arguments that are records, with their addresses in this process."""
    for k, kind in enumerate(kinds):
        if isinstance(kind, types.Record):
            yield k, arguments[k]


def _row_length(kind: types.Record, here: int) -> int:
    """Numbers per row if the record is a run; otherwise 0."""
    if "row" not in kind.fields:
        return 0
    row = kind.fields["row"]
    return _long(here + row.offset + row.type.fields["length"].offset)


def _long(at: int) -> int:
    return ctypes.c_int64.from_address(at).value


class Wasmtime(ForeignKernel):
    """A file of the kernel in wasmtime.

    Args:
        path: The file.

    Raises:
        MissingPackageError: If wasmtime is not installed.
    """

    def __init__(self, path: Path) -> None:
        wasmtime = import_optional("wasmtime")
        self._store = wasmtime.Store(wasmtime.Engine())
        module = wasmtime.Module.from_file(self._store.engine, str(path))
        assert not module.imports, "the kernel needs nothing from outside"
        self.exports: Any = wasmtime.Instance(self._store, module, []).exports(self._store)
        self._memory = self.exports["memory"]
        super().__init__()

    def heap(self) -> int:
        """Address of the start of free memory."""
        return self.exports["__heap_base"].value(self._store)

    def grow(self, size: int) -> None:
        """Grows the memory to at least this size [bytes]."""
        missing = size - self._memory.data_len(self._store)
        if missing > 0:
            self._memory.grow(self._store, -(-missing // _PAGE))

    def perform(
        self,
        symbol: str,
        writes: Sequence[Block],
        arguments: Sequence[Any],
        longs: Sequence[bool],
        reads: Sequence[Span],
    ) -> tuple[Any, list[bytes]]:
        """Writes blocks, calls a function, and reads spans of memory."""
        for at, content in writes:
            self.write(at, content)
        result = self.exports[symbol](self._store, *arguments)
        return result, [self.read(at, size) for at, size in reads]

    def write(self, at: int, content: bytes) -> None:
        """Writes a part of the memory."""
        self._memory.write(self._store, content, at)

    def read(self, at: int, size: int) -> bytes:
        """Reads a part of the memory."""
        return bytes(self._memory.read(self._store, at, at + size))

    def invoke(self, symbol: str, *arguments: Any) -> Any:
        """Calls a function with numbers and addresses."""
        return self.exports[symbol](self._store, *arguments)
