"""One account of memory: what fits, waits, or is refused in words."""

from __future__ import annotations

import asyncio
import random
import re
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from slipgrasp.core.executors import limits
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.recordings.file.recorder import record
from slipgrasp.recordings.file.size import read_size, size_of_run
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.server import budget
from slipgrasp.server.budget import DEFAULT_BYTES, SMALL_BYTES, MemoryBudget, Need, default_limit
from slipgrasp.server.exceptions import MemoryLimitError, ServiceBusyError
from slipgrasp.server.runs.service import RunService
from slipgrasp.server.settings import LEAST_MEMORY
from tests.server.serving import patient_settings, serve
from tests.waiting import PATIENCE, wait_until

LARGE = 10 * SMALL_BYTES
ALL = Need(LARGE, "this job", "do less")


class Owner:
    """Something that is kept in memory."""


def test_who_needs_more_than_is_left_waits_for_its_turn() -> None:
    async def take_turns() -> None:
        memory = MemoryBudget(LARGE)
        order: list[str] = []

        async def use(name: str, num_bytes: int) -> None:
            async with memory.reserve_async(Need(num_bytes, name)):
                order.append(name)
                await asyncio.sleep(0.01)

        await asyncio.gather(use("all", LARGE), use("half", LARGE // 2), use("none", 1))
        assert order == ["all", "none", "half"]

    asyncio.run(take_turns())


def test_who_waits_too_long_is_told_to_come_back() -> None:
    async def wait() -> None:
        memory = MemoryBudget(LARGE, patience=0.05)
        async with memory.reserve_async(ALL):
            with pytest.raises(ServiceBusyError, match="try again in 5 s"):
                async with memory.reserve_async(ALL):
                    pass
        async with memory.reserve_async(ALL):
            pass

    asyncio.run(wait())


def test_memory_is_passed_on_over_those_who_have_just_left() -> None:
    async def use(memory: MemoryBudget) -> str:
        async with memory.reserve_async(ALL):
            return "read"

    async def leave_while_another_ends() -> None:
        memory = MemoryBudget(LARGE)
        async with memory.reserve_async(ALL):
            leaving = [asyncio.create_task(use(memory)) for _ in range(2)]
            staying = asyncio.create_task(use(memory))
            await asyncio.sleep(0)
            for task in leaving:
                task.cancel()
        # They hear of it only after the memory was given back.
        assert await asyncio.wait_for(staying, PATIENCE) == "read"
        gone = await asyncio.gather(*leaving, return_exceptions=True)
        assert [type(each) for each in gone] == [asyncio.CancelledError] * 2
        assert await asyncio.wait_for(use(memory), PATIENCE) == "read"

    asyncio.run(leave_while_another_ends())


def test_a_job_that_can_never_fit_is_refused_with_the_numbers_and_the_way_out() -> None:
    memory = MemoryBudget(LARGE)
    with (
        pytest.raises(MemoryLimitError) as refused,
        memory.reserve(Need(2 * LARGE, "this job", "wait")),
    ):
        pass
    assert str(refused.value) == (
        "this job needs 160 MB of memory, and there are 80 MB for it; wait, or start the server "
        "with --memory of at least 160MB"
    )
    assert memory.left == LARGE


def test_a_thread_that_waits_too_long_is_told_to_come_back() -> None:
    memory = MemoryBudget(LARGE, patience=0.05)
    with memory.reserve(ALL):
        with pytest.raises(ServiceBusyError, match="try again in 5 s"), memory.reserve(ALL):
            pass
        with memory.reserve(Need(SMALL_BYTES - 1, "little")):
            assert memory.left < 0
    assert memory.left == LARGE


def test_a_job_that_nobody_needs_any_more_goes_on_without_memory_to_end() -> None:
    memory = MemoryBudget(LARGE, patience=0.0)
    is_void = threading.Event()
    with ThreadPoolExecutor(1) as threads, memory.reserve(ALL):

        def work() -> int:
            with memory.reserve(ALL, is_void.is_set) as lease:
                return lease.num_bytes

        done = threads.submit(work)
        is_void.set()
        assert done.result(PATIENCE) == 0
    assert memory.left == LARGE


def test_what_a_job_leaves_counts_until_it_is_gone() -> None:
    memory, owner = MemoryBudget(LARGE), Owner()
    with memory.reserve_to_hold(ALL) as lease:
        lease.keep(owner, 1000)
    assert (memory.left, memory.held) == (LARGE - 1000, 1000)
    del owner
    assert (memory.left, memory.held) == (LARGE, 0)


@pytest.mark.parametrize("seed", range(4))
def test_jobs_together_never_have_more_than_there_is(seed: int) -> None:
    memory, draw, lock = (
        MemoryBudget(LARGE, patience=PATIENCE),
        random.Random(seed),
        threading.Lock(),
    )
    used, most = 0, 0

    def work(num_bytes: int) -> None:
        nonlocal used, most
        with memory.reserve(Need(num_bytes, "job")):
            with lock:
                used += num_bytes
                most = max(most, used)
            with lock:
                used -= num_bytes

    sizes = [draw.randrange(SMALL_BYTES, LARGE) for _ in range(60)]
    with ThreadPoolExecutor(8) as threads:
        list(threads.map(work, sizes))
    assert 0 < most <= LARGE
    assert (memory.left, used) == (LARGE, 0)


@pytest.mark.parametrize("name", ["paper-case-1", "composite-case-2-noisy", "spatial-box"])
def test_the_estimate_of_a_run_is_at_least_what_it_takes(name: str, tmp_path: Path) -> None:
    scenario = load_scenario(name)
    run = simulate(scenario)
    record(scenario, tmp_path / "run.mcap")
    assert read_size(tmp_path / "run.mcap").num_bytes == size_of_run(run)
    arrays = (getattr(run.trace, each) for each in run.trace.__slots__)
    held = sum(array.nbytes for array in arrays if hasattr(array, "nbytes"))
    assert held <= size_of_run(run) <= Need.to_keep_run(scenario).num_bytes


def test_the_account_is_at_most_half_of_a_small_machine(monkeypatch) -> None:
    monkeypatch.setattr(limits, "_CGROUP_LIMIT", Path("/there/is/none"))
    for machine, expected in ((0, DEFAULT_BYTES), (10**9, 5 * 10**8), (10**12, DEFAULT_BYTES)):
        monkeypatch.setattr("slipgrasp.server.budget.machine_memory", lambda m=machine: m)
        assert default_limit() == expected


def test_a_run_waits_for_memory_as_long_as_it_takes(tmp_path: Path) -> None:
    settings = patient_settings(tmp_path, memory_bytes=LEAST_MEMORY)
    long = with_values(load_scenario("paper-case-1"), {"simulation.duration": 500.0})
    service = RunService(RecordingStore(tmp_path), settings)
    service.start()
    try:
        with service.memory.reserve(Need(LEAST_MEMORY, "others")):
            pending = service.submit(lambda: load_scenario("paper-case-1"))
            stopped = service.submit(lambda: long)
            wait_until(lambda: service.load.running == 2)
            service.stop(stopped.id)
            assert stopped.result()[0].outcome == "stopped"
            assert not pending.done()
        assert pending.result()[0].outcome == "completed"
        assert service.memory.left == LEAST_MEMORY
    finally:
        service.close()


def test_a_preview_that_can_never_fit_is_refused_before_it_begins(tmp_path: Path) -> None:
    service = RunService(RecordingStore(tmp_path), patient_settings(tmp_path))
    values = {"simulation.duration": 200.0, "simulation.output_rate": 10_000.0}
    scenario = with_values(load_scenario("spatial-box"), values)
    with pytest.raises(MemoryLimitError, match=r"this run needs \d+ MB .* POST /runs"):
        service.preview(scenario)
    service.close()


def test_too_long_a_comparison_is_refused_in_words_while_figure_and_tables_are_made(
    tmp_path: Path, monkeypatch
) -> None:
    """What needs all samples at once is refused at once; what needs few of them is made."""
    # As if this run of 15 s were one of 90 s.
    for name in ("DIFF_COST", "TABLE_COST"):
        monkeypatch.setattr(budget, name, 6.0 * getattr(budget, name))
    monkeypatch.setattr("slipgrasp.server.routes.run_files.MOST_EXPORTED_WHOLE", 20_000)
    values = {"simulation.duration": 15.0, "simulation.output_rate": 2000.0}
    with serve(patient_settings(tmp_path, memory_bytes=240_000_000)) as running:
        with running.client() as client:
            asked = {"scenario": "paper-case-1", "set": values}
            run_id = client.post("/runs", json=asked).json()["id"]
            pair, path = {"a": run_id, "b": run_id}, f"/runs/{run_id}/signals"
            refused = [client.get("/diff", params=pair), client.get(f"{path}.npz")]
            tables = [client.get(f"{path}.{name}") for name in ("csv", "parquet")]
            figure = client.get("/diff/figure", params={**pair, "format": "png"})
            short = client.get(path, params={"names": "slip", "t_to": 1.0})
        memory = running.app.state.run_service.memory
        wait_until(lambda: memory.left == memory.limit, "something was not given back")
    for answer in refused:
        assert answer.status_code == 422
        assert answer.headers["Content-Type"] == "application/problem+json"
        told = answer.json()["detail"]
        assert re.search(r"needs \d+ MB of memory, and there are 240 MB for it; .*--memory", told)
    assert {answer.status_code for answer in (figure, short, *tables)} == {200}
    assert tables[0].content.count(b"\n") > 30_000
    assert tables[1].content.endswith(b"PAR1")
    assert figure.content.startswith(b"\x89PNG")
