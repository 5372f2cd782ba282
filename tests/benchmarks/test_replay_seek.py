"""What scrubbing through a recording sends to a viewer."""

from __future__ import annotations

import re

import pytest

from benchmarks.replay_seek import run

pytestmark = pytest.mark.slow


def test_a_seek_does_not_send_the_charts_again() -> None:
    ((note,),) = (table.notes for table in run(seeks=5, duration=20.0))
    found = re.search(r"A seek sends ([0-9.]+) kB; opening the recording sent ([0-9]+) kB", note)
    assert found
    assert float(found[1]) < 0.05 * float(found[2])
