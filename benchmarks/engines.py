"""The kernel in WebAssembly as an engine of this program: what Python calls of it runs there."""

from __future__ import annotations

import base64
import ctypes
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import Unit, record_type
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.compilation.webassembly import RECORDS
from slipgrasp.core.kernel.loop.progress import tick_columns
from slipgrasp.core.kernel.loop.status import RUNNING
from slipgrasp.core.kernel.planar.packing import whole_faces
from slipgrasp.core.kernel.planar.rows import ROW
from slipgrasp.core.kernel.planar.run import OUTLET, PROGRESS
from slipgrasp.core.scenario.space import PLANAR

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

SCRIPT = Path(__file__).parents[1] / "docs" / "webassembly.js"

_TICK_BYTES = 8 * tick_columns(PLANAR.joints_per_finger)

# Steps of a run in one call.
STEPS = 1000

_LINE, _PAGE = 64, 65536
_ROWS = OUTLET.fields["rows"][1]
_NUM_ROWS = OUTLET.fields["num_rows"][1]
_TICKS, _NUM_TICKS = OUTLET.fields["ticks"][1], OUTLET.fields["num_ticks"][1]
_NUM_CHANGES = PROGRESS.fields["num_changes"][1]
_ROW_LENGTH = PROGRESS.fields["row"][1] + ROW.fields["length"][1]

Block = tuple[int, bytes]
Span = tuple[int, int]


# What a page needs beside the script to serve as an engine.
_LOAD = """async ([script, file]) => {
  const module = await import("data:text/javascript;base64," + script);
  const decode = text => Uint8Array.from(atob(text), c => c.charCodeAt(0));
  const kernel = await module.loadKernel(decode(file));
  const memory = kernel.exports.memory;
  const encode = bytes => {
    const parts = [];
    for (let k = 0; k < bytes.length; k += 8192)
      parts.push(String.fromCharCode(...bytes.subarray(k, k + 8192)));
    return btoa(parts.join(""));
  };
  const read = (at, size) => encode(new Uint8Array(memory.buffer, at, size));
  const grow = size => {
    const missing = size - memory.buffer.byteLength;
    if (missing > 0) memory.grow(Math.ceil(missing / 65536));
  };
  const perform = (symbol, writes, values, longs, reads) => {
    for (const [at, text] of writes) new Uint8Array(memory.buffer).set(decode(text), at);
    const result = kernel.exports[symbol](...values.map((v, k) => longs[k] ? BigInt(v) : v));
    return [Number(result ?? 0), reads.map(span => read(...span))];
  };
  Object.assign(window, { ...module, kernel, decode, encode, read, grow, perform });
  return kernel.exports.__heap_base.value;
}"""


_ROWS_OF_RUN = """text => {
  const { columns, blocks } = run(kernel, new Float64Array(decode(text).buffer));
  return [columns, blocks.map(block => encode(new Uint8Array(block.buffer)))];
}"""
_TIME = """text => {
  const table = new Float64Array(decode(text).buffer);
  const start = performance.now();
  run(kernel, table);
  return performance.now() - start;
}"""


class Engine(ABC):
    """Copies records into the memory of another engine, runs a unit there, and copies them back.

    Of the outlet only what is in use is copied: the rows of a run would take a hundred times as
    long as the run.
    """

    def __init__(self) -> None:
        self._places: dict[types.Record, int] = {}
        self._end = self.heap()

    @abstractmethod
    def heap(self) -> int:
        """Where free memory begins."""

    @abstractmethod
    def grow(self, size: int) -> None:
        """Makes the memory at least so large [bytes]."""

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
            writes: Addresses, and what is written there.
            arguments: Of the function.
            longs: Which of them are integers of 64 bits.
            reads: Addresses and sizes.
        """

    @abstractmethod
    def read(self, at: int, size: int) -> bytes:
        """A part of the memory."""

    @abstractmethod
    def seconds_of_run(self, table: Record, end: float) -> float:
        """Wall time of one run in the engine, without what copies it to Python [s].

        Args:
            table: The numbers of a scenario without pulses, patches and timed changes.
            end: When it ends [s].
        """

    def enter(self, unit: Unit) -> Callable[..., Any]:
        """The function called in place of a unit, for `compiler.entered_by`."""
        kinds = unit.signature.args
        records = [k for k, kind in enumerate(kinds) if isinstance(kind, types.Record)]

        def call(*arguments: Any) -> Any:
            at = {k: self._place(kinds[k]) for k in records}
            used = [(k, offset, size) for k in records for offset, size in _used(kinds[k])]
            spans = [(at[k] + offset, size) for k, offset, size in used]
            writes = [
                (at[k] + offset, ctypes.string_at(arguments[k] + offset, size))
                for k, offset, size in used
            ]
            there = [at.get(k, value) for k, value in enumerate(arguments)]
            longs = [kind is types.int64 for kind in kinds]
            result, contents = self.perform(unit.symbol, writes, there, longs, spans)
            for (k, offset, size), content in zip(used, contents, strict=True):
                ctypes.memmove(arguments[k] + offset, content, size)
            for k in records:
                if kinds[k].size == OUTLET.itemsize:
                    self._copy_buffers(arguments[k], at[k])
            return result

        return call

    def _place(self, kind: types.Record) -> int:
        """Where records of one kind lie; two of them in one call would share it."""
        if kind not in self._places:
            self._places[kind] = -(-self._end // _LINE) * _LINE
            self._end = self._places[kind] + kind.size
            self.grow(self._end)
        return self._places[kind]

    def _copy_buffers(self, outlet: int, at: int) -> None:
        """Copies the rows, and what was commanded at ticks."""
        run = next((p for kind, p in self._places.items() if kind.size == PROGRESS.itemsize))
        count, length = (self._long(place) for place in (at + _NUM_ROWS, run + _ROW_LENGTH))
        rows = self.read(at + _ROWS, 8 * count * length)
        ctypes.memmove(outlet + _ROWS, rows, len(rows))
        ticks = self.read(
            at + _TICKS, 8 * tick_columns(PLANAR.joints_per_finger) * self._long(at + _NUM_TICKS)
        )
        ctypes.memmove(outlet + _TICKS, ticks, len(ticks))

    def _long(self, at: int) -> int:
        return int.from_bytes(self.read(at, 8), "little")


def _used(kind: types.Record) -> Sequence[Span]:
    """Offsets and sizes of what is copied of a record with every call."""
    return ((0, _ROWS), (_NUM_TICKS, 8)) if kind.size == OUTLET.itemsize else ((0, kind.size),)


class Wasmtime(Engine):
    """The file in wasmtime."""

    def __init__(self, path: Path) -> None:
        import wasmtime

        self._store = wasmtime.Store(wasmtime.Engine())
        module = wasmtime.Module.from_file(self._store.engine, str(path))
        assert not module.imports, "slipgrasp.wasm needs nothing from outside"
        self.exports: Any = wasmtime.Instance(self._store, module, []).exports(self._store)
        self._memory = self.exports["memory"]
        super().__init__()

    def heap(self) -> int:
        """Where free memory begins."""
        return self.exports["__heap_base"].value(self._store)

    def grow(self, size: int) -> None:
        """Makes the memory at least so large [bytes]."""
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
            self._memory.write(self._store, content, at)
        result = self.exports[symbol](self._store, *arguments)
        return result, [self.read(at, size) for at, size in reads]

    def read(self, at: int, size: int) -> bytes:
        """A part of the memory."""
        return bytes(self._memory.read(self._store, at, at + size))

    def seconds_of_run(self, table: Record, end: float) -> float:
        """Wall time of one run in the engine, without what copies it to Python [s]."""
        call, store = self.exports, self._store
        at = {name: self._place(record_type(layout)) for name, layout in RECORDS.items()}
        start = time.perf_counter()
        for name, content in (("table", table), ("stretch", whole_faces())):
            self._memory.write(store, content.tobytes(), at[name])
        self._memory.write(store, bytes(PROGRESS.itemsize), at["run"])
        call["slipgrasp_pack"](store, at["table"], at["stretch"], at["model"])
        call["slipgrasp_begin_run"](store, at["table"], at["run"], at["outlet"], 1)
        places, status, rows = (at["model"], at["run"], at["outlet"]), RUNNING, []
        while status == RUNNING:
            status = call["slipgrasp_advance"](store, *places, end, 1, 0, STEPS)
            count = self._long(at["outlet"] + _NUM_ROWS) * self._long(at["run"] + _ROW_LENGTH)
            rows.append(self.read(at["outlet"] + _ROWS, 8 * count))
            self._memory.write(store, bytes(8), at["outlet"] + _NUM_ROWS)
            self._memory.write(store, bytes(8), at["outlet"] + _NUM_TICKS)
            self._memory.write(store, bytes(8), at["run"] + _NUM_CHANGES)
        return time.perf_counter() - start


class Chromium(Engine):
    """The file in a page of Chromium, by the script that the documentation shows."""

    def __init__(self, path: Path, browser: Browser) -> None:
        self.page: Page = browser.new_page()
        script = base64.b64encode(SCRIPT.read_bytes()).decode()
        file = base64.b64encode(path.read_bytes()).decode()
        self._heap = self.page.evaluate(_LOAD, [script, file])
        super().__init__()

    def heap(self) -> int:
        """Where free memory begins."""
        return self._heap

    def grow(self, size: int) -> None:
        """Makes the memory at least so large [bytes]."""
        self.page.evaluate("size => grow(size)", size)

    def perform(
        self,
        symbol: str,
        writes: Sequence[Block],
        arguments: Sequence[Any],
        longs: Sequence[bool],
        reads: Sequence[Span],
    ) -> tuple[Any, list[bytes]]:
        """Writes blocks, calls a function, and reads spans of memory."""
        blocks = [[at, base64.b64encode(content).decode()] for at, content in writes]
        result, contents = self.page.evaluate(
            "call => perform(...call)",
            [symbol, blocks, list(arguments), list(longs), [list(span) for span in reads]],
        )
        return result, [base64.b64decode(content) for content in contents]

    def read(self, at: int, size: int) -> bytes:
        """A part of the memory."""
        return base64.b64decode(self.page.evaluate("([at, size]) => read(at, size)", [at, size]))

    def rows_of_run(self, table: Record) -> Floats:
        """The rows of a run without pulses, patches and timed changes, ``(rows, columns)``."""
        numbers = base64.b64encode(table.tobytes()).decode()
        columns, blocks = self.page.evaluate(_ROWS_OF_RUN, numbers)
        rows = b"".join(base64.b64decode(block) for block in blocks)
        return np.frombuffer(rows, "<f8").reshape(-1, columns)

    def seconds_of_run(self, table: Record, end: float) -> float:
        """Wall time of one run in the engine, without what copies it to Python [s]."""
        numbers = base64.b64encode(table.tobytes()).decode()
        return 1e-3 * self.page.evaluate(_TIME, numbers)
