"""The kernel in WebAssembly as an engine of this program, called from Python."""

from __future__ import annotations

import base64
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from slipgrasp.core.kernel.compilation.compiler import Unit, record_type
from slipgrasp.core.kernel.compilation.records import Floats, Record
from slipgrasp.core.kernel.loop.status import RUNNING
from slipgrasp.core.kernel.planar.packing import whole_faces
from slipgrasp.core.kernel.planar.rows import ROW
from slipgrasp.core.kernel.planar.run import OUTLET, PROGRESS
from slipgrasp.core.kernel.webassembly.build import RECORDS
from slipgrasp.core.kernel.webassembly.foreign import Block, ForeignKernel, Span, Wasmtime

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

SCRIPT = Path(__file__).parents[1] / "web" / "standalone" / "kernel.js"

# Number of steps of a run in one call.
STEPS = 1000

_ROWS = OUTLET.fields["rows"][1]
_NUM_ROWS = OUTLET.fields["num_rows"][1]
_NUM_TICKS = OUTLET.fields["num_ticks"][1]
_NUM_CHANGES = PROGRESS.fields["num_changes"][1]
_ROW_LENGTH = PROGRESS.fields["row"][1] + ROW.fields["length"][1]

# Additional script for a page that serves as an engine.
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


class Engine(Protocol):
    """An engine in which a run is timed."""

    def enter(self, unit: Unit) -> Callable[..., Any]:
        """The replacement of a unit, for `compiler.entered_by`."""
        ...

    def seconds_of_run(self, table: Record, end: float) -> float:
        """Wall time of one run in the engine, without copying it to Python [s].

        Args:
            table: The numbers of a scenario without pulses, patches and timed changes.
            end: End time [s].
        """
        ...


class TimedWasmtime(Wasmtime):
    """The file in wasmtime."""

    def seconds_of_run(self, table: Record, end: float) -> float:
        """Wall time of one run in the engine, without copying it to Python [s]."""
        at = {name: self.place(record_type(layout)) for name, layout in RECORDS.items()}
        start = time.perf_counter()
        for name, content in (("table", table), ("stretch", whole_faces())):
            self.write(at[name], content.tobytes())
        self.write(at["run"], bytes(PROGRESS.itemsize))
        self.invoke("slipgrasp_pack", at["table"], at["stretch"], at["model"])
        self.invoke("slipgrasp_begin_run", at["table"], at["run"], at["outlet"], 1)
        places, status, rows = (at["model"], at["run"], at["outlet"]), RUNNING, []
        while status == RUNNING:
            status = self.invoke("slipgrasp_advance", *places, end, 1, 0, STEPS)
            count = self._long(at["outlet"] + _NUM_ROWS) * self._long(at["run"] + _ROW_LENGTH)
            rows.append(self.read(at["outlet"] + _ROWS, 8 * count))
            self.write(at["outlet"] + _NUM_ROWS, bytes(8))
            self.write(at["outlet"] + _NUM_TICKS, bytes(8))
            self.write(at["run"] + _NUM_CHANGES, bytes(8))
        return time.perf_counter() - start

    def _long(self, at: int) -> int:
        return int.from_bytes(self.read(at, 8), "little")


class Chromium(ForeignKernel):
    """The file in a page of Chromium, with the script of the documentation."""

    def __init__(self, path: Path, browser: Browser) -> None:
        self.page: Page = browser.new_page()
        script = base64.b64encode(SCRIPT.read_bytes()).decode()
        file = base64.b64encode(path.read_bytes()).decode()
        self._heap = self.page.evaluate(_LOAD, [script, file])
        super().__init__()

    def heap(self) -> int:
        """Start address of free memory."""
        return self._heap

    def grow(self, size: int) -> None:
        """Grows the memory to at least this size [bytes]."""
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
        """A span of the memory."""
        return base64.b64decode(self.page.evaluate("([at, size]) => read(at, size)", [at, size]))

    def rows_of_run(self, table: Record) -> Floats:
        """The rows of a run without pulses, patches and timed changes, ``(rows, columns)``."""
        numbers = base64.b64encode(table.tobytes()).decode()
        columns, blocks = self.page.evaluate(_ROWS_OF_RUN, numbers)
        rows = b"".join(base64.b64decode(block) for block in blocks)
        return np.frombuffer(rows, "<f8").reshape(-1, columns)

    def seconds_of_run(self, table: Record, end: float) -> float:
        """Wall time of one run in the engine, without copying it to Python [s]."""
        numbers = base64.b64encode(table.tobytes()).decode()
        return 1e-3 * self.page.evaluate(_TIME, numbers)
