"""How much of recordings is in memory at a time, and for whom."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path

import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.file.stretch import Stretch
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.server import reading
from slipgrasp.server.exceptions import ServiceBusyError
from slipgrasp.server.reading import SMALL_BYTES, RecordingReads
from tests.waiting import PATIENCE

LARGE = 10 * SMALL_BYTES
SLIP = Stretch(signals=frozenset({"slip"}))


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
        reads = RecordingReads()
        async with (
            reads.shared(path, "run", SLIP, 0.1, stays) as a,
            reads.shared(path, "run", SLIP, 0.1, stays) as b,
            reads.shared(path, "run", replace(SLIP, end=0.005), 0.1, stays) as part,
        ):
            assert a is b and len(part) < len(a)
        async with reads.shared(path, "run", SLIP, 0.1, stays) as c:
            assert c is not a

    asyncio.run(read_twice())


def test_who_needs_more_than_is_left_waits_for_its_turn() -> None:
    async def take_turns() -> None:
        reads, order = RecordingReads(LARGE), []

        async def use(name: str, num_bytes: int) -> None:
            async with reads.room(num_bytes):
                order.append(name)
                await asyncio.sleep(0.01)

        await asyncio.gather(use("all", 3 * LARGE), use("half", LARGE // 2), use("none", 1))
        assert order == ["all", "none", "half"]

    asyncio.run(take_turns())


def test_who_waits_too_long_is_told_to_come_back() -> None:
    async def wait() -> None:
        reads = RecordingReads(LARGE, patience=0.05)
        async with reads.room(LARGE):
            with pytest.raises(ServiceBusyError, match="try again in 5 s"):
                async with reads.room(LARGE):
                    pass
        async with reads.room(LARGE):
            pass

    asyncio.run(wait())


def test_memory_is_passed_on_over_those_who_have_just_left() -> None:
    async def use(reads: RecordingReads, num_bytes: int) -> str:
        async with reads.room(num_bytes):
            return "read"

    async def leave_while_another_ends() -> None:
        reads = RecordingReads(LARGE)
        async with reads.room(LARGE):
            leaving = [asyncio.create_task(use(reads, LARGE)) for _ in range(2)]
            staying = asyncio.create_task(use(reads, LARGE))
            await asyncio.sleep(0)
            for task in leaving:
                task.cancel()
        # They hear of it only after the memory was given back.
        assert await asyncio.wait_for(staying, PATIENCE) == "read"
        gone = await asyncio.gather(*leaving, return_exceptions=True)
        assert [type(each) for each in gone] == [asyncio.CancelledError] * 2
        assert await asyncio.wait_for(use(reads, LARGE), PATIENCE) == "read"

    asyncio.run(leave_while_another_ends())


def test_nothing_is_read_for_a_client_that_has_gone(path, monkeypatch) -> None:
    monkeypatch.setattr(reading, "POLL_SECONDS", 0.0)

    async def leave() -> None:
        reads = RecordingReads(LARGE)
        with pytest.raises(ServiceBusyError):
            async with reads.shared(path, "run", SLIP, 0.1, leaves):
                pass
        async with reads.room(LARGE), reads.shared(path, "run", SLIP, 0.1, stays):
            pass

    asyncio.run(leave())
