"""What becomes of memory that a service has freed."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

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


@pytest.mark.skipif(sys.platform != "linux", reason="measured with /proc, mended for glibc")
def test_what_threads_have_read_and_freed_is_the_systems_again():
    # Dask, in a test before this one, leaves settings of the C library for processes to come.
    unset = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}
    given_back, otherwise = (
        int(subprocess.check_output([sys.executable, "-c", READING, how], text=True, env=unset))
        for how in ("given back", "otherwise")
    )
    assert given_back < 40e6
    assert otherwise > 2 * given_back, "the C library gives it back by itself: it is needless"
