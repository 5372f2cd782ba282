"""Signals that several ask for at once."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.file.segment import Segment
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.server import reading
from slipgrasp.server.budget import SMALL_BYTES, MemoryBudget, Need
from slipgrasp.server.exceptions import ServiceBusyError
from slipgrasp.server.reading import RecordingReads

LARGE = 10 * SMALL_BYTES
ALL = Need(LARGE, "all")
NEED = Need(1000, "signals")
SLIP = Segment(signals=frozenset({"slip"}))


@pytest.fixture
def path(short_result: RunResult, tmp_path: Path) -> Path:
    path = tmp_path / "run.mcap"
    write_recording(short_result, path)
    return path


async def stays() -> bool:
    return False


async def leaves() -> bool:
    return True


def test_readers_at_the_same_time_share_what_was_read(path) -> None:
    async def read_twice() -> None:
        reads = RecordingReads(MemoryBudget(LARGE))
        async with (
            reads.shared(path, "run", SLIP, NEED, stays) as a,
            reads.shared(path, "run", SLIP, NEED, stays) as b,
            reads.shared(path, "run", replace(SLIP, end=0.005), NEED, stays) as part,
        ):
            assert a is b and len(part) < len(a)
        async with reads.shared(path, "run", SLIP, NEED, stays) as c:
            assert c is not a

    asyncio.run(read_twice())


def test_nothing_is_read_for_a_client_that_has_gone(path, monkeypatch) -> None:
    monkeypatch.setattr(reading, "POLL_SECONDS", 0.0)

    async def leave() -> None:
        memory = MemoryBudget(LARGE)
        reads = RecordingReads(memory)
        with pytest.raises(ServiceBusyError):
            async with reads.shared(path, "run", SLIP, NEED, leaves):
                pass
        async with memory.reserve_async(ALL), reads.shared(path, "run", SLIP, NEED, stays):
            pass

    asyncio.run(leave())
