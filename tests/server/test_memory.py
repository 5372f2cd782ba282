"""What becomes of memory that a service has freed."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from tests.waiting import PATIENCE

READING = """
import sys, threading
from pathlib import Path
import numpy as np
from slipgrasp.server.memory import give_back_freed_memory

def resident():
    return 4096 * int(Path("/proc/self/statm").read_text().split()[1])

if sys.argv[1] == "given back":
    give_back_freed_memory()
before, turn, kept = resident(), threading.Barrier(8), []

def read():
    del_first = np.ones(3_500_000)
    del del_first
    for _ in range(3):
        columns = []
        for _ in range(8):
            columns.append(np.ones(400_000))
            kept.append(np.ones(10_000))
        turn.wait()
        del columns

threads = [threading.Thread(target=read) for _ in range(8)]
for thread in threads: thread.start()
for thread in threads: thread.join()
print(resident() - before)
"""


SCATTERED = """
import sys, threading, time
from pathlib import Path
from slipgrasp.server.memory import give_back_freed_memory

def resident():
    return 4096 * int(Path("/proc/self/statm").read_text().split()[1])

def work():
    while True:
        pass

give_back_freed_memory(look_seconds=0.2)
for _ in range(int(sys.argv[1])):
    threading.Thread(target=work, daemon=True).start()
before = resident()
blocks = [bytes(20_000) for _ in range(5_000)]
kept = blocks[::50]
del blocks
print(resident() - before)
deadline = time.monotonic() + float(sys.argv[2])
while resident() - before > 30e6 and time.monotonic() < deadline:
    time.sleep(0.2)
print(resident() - before)
"""

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="measured with /proc, mended for glibc"
)


def printed_numbers(program, *arguments):
    """What a program prints as numbers in a process of its own."""
    # Dask, in a test before this one, leaves settings of the C library for processes to come.
    unset = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    command = [sys.executable, "-c", program, *arguments]
    return [int(word) for word in subprocess.check_output(command, text=True, env=unset).split()]


def test_what_threads_have_read_and_freed_is_the_systems_again():
    [given_back] = printed_numbers(READING, "given back")
    [otherwise] = printed_numbers(READING, "otherwise")
    assert given_back < 40e6
    assert otherwise > 2 * given_back, "the C library gives it back by itself: it is needless"


@pytest.mark.parametrize("busy_threads", [0, 1])
def test_what_lies_free_between_used_blocks_is_the_systems_again_also_in_a_busy_process(
    busy_threads,
):
    freed, left = printed_numbers(SCATTERED, str(busy_threads), str(PATIENCE))
    assert freed > 60e6, "the C library gives it back by itself: it is needless"
    assert left < 30e6


ARROW = """
from pathlib import Path
import numpy as np
from slipgrasp.server.memory import give_back_freed_memory

give_back_freed_memory()
import pyarrow

def anonymous():
    text = Path("/proc/self/smaps_rollup").read_text()
    return 1024 * int(text.partition("Anonymous:")[2].split()[0])

pyarrow.array(np.ones(10))
before = anonymous()
column = pyarrow.array(np.ones(1_000_000))
table = pyarrow.concat_arrays([column] * 4)
del column, table
print(anonymous() - before)
"""


def test_arrow_returns_freed_memory_to_the_system():
    """Its default allocator retains 36 MB."""
    [retained] = printed_numbers(ARROW)
    assert retained < 1e6


CYCLES = """
import sys, time
from slipgrasp.server.memory import give_back_freed_memory

class Figure:
    freed = 0

    def __init__(self):
        self.own, self.parts = self, [object() for _ in range(1_000)]

    def __del__(self):
        Figure.freed += 1

give_back_freed_memory(look_seconds=0.2)
figures = [Figure() for _ in range(10)]
del figures
before, deadline = Figure.freed, time.monotonic() + float(sys.argv[1])
while Figure.freed < 10 and time.monotonic() < deadline:
    time.sleep(0.1)
print(before, Figure.freed)
"""


def test_figures_in_cycles_are_freed_as_soon_as_the_service_is_idle():
    assert printed_numbers(CYCLES, str(PATIENCE)) == [0, 10]
