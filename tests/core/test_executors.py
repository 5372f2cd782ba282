"""Engines: the same results everywhere, no task lost or done twice, and an end when asked."""

import itertools
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import pytest

from slipgrasp.core import awake_clock
from slipgrasp.core.awake_clock import LONGEST_GAP, AwakeClock
from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.executors import AHEAD, ExecutorError, make_executor, processes, single
from slipgrasp.core.executors.limits import LEAST_MEMORY, WorkerLimits
from slipgrasp.core.executors.processes import ProcessExecutor
from slipgrasp.core.executors.single import SingleTasks, WorkerDiedError
from slipgrasp.core.executors.worker_process import WorkerProcess
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.core import executor_tasks as work
from tests.waiting import PATIENCE, wait_until

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("kernel")]

SCRIPT = """
import sys
from slipgrasp.core.executors import make_executor
from tests.core.executor_tasks import process_id, wait_until_asked

executor = make_executor("processes", workers=1)
for finished in executor.map(process_id, [0], should_stop=lambda: False):
    print(finished.result, flush=True)
list(executor.map(wait_until_asked, [sys.argv[1]], should_stop=lambda: False))
"""


def go_on():
    return False


@pytest.fixture(scope="module")
def pool():
    with make_executor("processes", workers=2) as executor:
        executor.prepare()
        yield executor


@pytest.fixture(params=["inline", "processes"])
def engine(request, pool):
    return pool if request.param == "processes" else make_executor("inline")


def scenarios():
    """Runs that hold, slide and separate, short ones."""
    base = with_values(load_scenario("paper-case-2"), {"simulation.duration": 0.2})
    for k in range(6):
        values = {"fingers.0.friction": 0.1 + 0.05 * k, "object.mass": 0.7 + 0.2 * k}
        yield with_values(base, values)


def outcome_of(executor, function, tasks, should_stop=go_on):
    """All that is finished, by task."""
    done = list(executor.map(function, tasks, should_stop=should_stop))
    found = {finished.task: finished for finished in done}
    assert len(found) == len(done), "a task was finished twice"
    return found


def test_every_engine_gives_the_same_bits(pool):
    tasks = list(scenarios())
    expected = [work.hash_of(task, go_on) for task in tasks]
    for executor in (make_executor("inline"), pool):
        done = executor.map(work.hash_of, tasks, should_stop=go_on)
        hashes = {tasks.index(finished.task): finished.result for finished in done}
        assert [hashes[place] for place in range(len(tasks))] == expected


def test_every_task_is_done_once(engine):
    done = outcome_of(engine, work.square, range(500))
    assert {task: finished.result for task, finished in done.items()} == {
        task: task * task for task in range(500)
    }


def test_no_task_is_no_work(engine):
    assert outcome_of(engine, work.square, []) == {}


def test_an_error_of_the_function_comes_back_as_it_was(engine):
    with pytest.raises(ScenarioError, match=r"^\d is odd") as caught:
        list(engine.map(work.refuse_odd, range(10), should_stop=go_on))
    assert caught.value.errors[0].field == "object.mass"
    assert outcome_of(engine, work.refuse_odd, [4])[4].result == 4


def test_an_error_tells_where_in_the_worker_it_was_raised(pool):
    with pytest.raises(ScenarioError) as caught:
        list(pool.map(work.refuse_odd, [1], should_stop=go_on))
    assert "in refuse_odd" in caught.value.__notes__[0]


def test_a_result_that_cannot_be_sent_is_an_error_and_no_hang(pool):
    with pytest.raises(TypeError, match="lock"):
        list(pool.map(work.give_a_lock, [0], should_stop=go_on))


def test_what_a_task_prints_and_reads_does_not_disturb_the_engine(pool):
    done = outcome_of(pool, work.print_and_read, range(3))
    assert [finished.result for finished in done.values()] == [b"", b"", b""]


def test_workers_stay_warm_between_two_maps(pool):
    processes = set()
    for _ in range(3):
        done = outcome_of(pool, work.process_id, range(20))
        processes |= {finished.result for finished in done.values()}
    assert len(processes) <= pool.num_workers
    assert os.getpid() not in processes


def test_workers_use_one_thread_each(pool):
    settings = outcome_of(pool, work.thread_setting, [0])[0].result
    assert set(settings.values()) == {"1"}


def test_an_interrupt_of_the_terminal_is_left_to_the_caller(pool):
    before = {done.result for done in outcome_of(pool, work.process_id, range(20)).values()}
    for process in before:
        os.kill(process, signal.SIGINT)
    after = {done.result for done in outcome_of(pool, work.process_id, range(20)).values()}
    assert after <= before


def test_tasks_are_done_from_any_thread(pool):
    with ThreadPoolExecutor(1) as thread:
        done = thread.submit(outcome_of, pool, work.square, range(5)).result()
    assert len(done) == 5


def test_the_task_of_a_killed_worker_is_tried_again(pool, tmp_path):
    deaths = tmp_path / "deaths"
    deaths.write_text("x")
    tasks = [(number, str(deaths) if number == 5 else None) for number in range(40)]
    done = outcome_of(pool, work.die_as_told, tasks)
    assert {finished.result for finished in done.values()} == set(range(40))
    assert deaths.read_text() == ""


def test_a_task_that_always_kills_its_worker_fails_and_the_others_finish(pool, tmp_path):
    deaths = tmp_path / "deaths"
    deaths.write_text("xxxxxxx")
    tasks = [(number, str(deaths) if number == 5 else None) for number in range(40)]
    done = outcome_of(pool, work.die_as_told, tasks)
    failed = [finished for finished in done.values() if finished.failure]
    assert [finished.task[0] for finished in failed] == [5]
    assert failed[0].result is None
    assert "died 5 times" in failed[0].failure and "SIGKILL" in failed[0].failure
    assert len(done) == 40 and len(deaths.read_text()) == 2


def test_a_task_that_goes_too_far_costs_itself_alone():
    told = {
        "segmentation fault": "its worker died 3 times; the last worker was killed by SIGSEGV",
        "memory": "its worker exceeded its memory limit of 0.4 GB",
        "time": "its worker exceeded the time limit of 2 s",
    }
    limits = WorkerLimits(memory=400_000_000, task_seconds=2.0)
    with ProcessExecutor(2, limits) as executor:
        found = outcome_of(executor, work.go_too_far, [*range(10), *told, *range(10, 20)])
        assert {kind: found[kind].failure for kind in told} == told
        assert [found[kind].result for kind in told] == [None] * 3
        assert [found[n].result for n in range(20)] == list(range(20))


def test_workers_share_half_of_the_machine_and_are_ended_before_who_started_them(pool):
    assert WorkerLimits.shared_by(1000).memory == LEAST_MEMORY
    assert WorkerLimits.shared_by(1).memory >= WorkerLimits.shared_by(2).memory
    (done,) = pool.map(work.memory_bounds, [0], should_stop=go_on)
    memory, score = done.result
    assert memory == WorkerLimits.shared_by(2).memory
    assert score > int(Path("/proc/self/oom_score_adj").read_text())


def test_a_worker_killed_in_the_middle_of_a_result_costs_only_time(pool, tmp_path):
    path = tmp_path / "worker"
    killed = threading.Event()

    def kill_while_it_sends():
        while not (path.exists() and path.read_text()):
            time.sleep(0.0005)
        os.kill(int(path.read_text()), signal.SIGKILL)
        killed.set()

    killer = threading.Thread(target=kill_while_it_sends)
    killer.start()
    done = outcome_of(pool, work.give_much, [str(path)])
    killer.join()
    assert killed.is_set()
    assert len(done[str(path)].result) == 5_000_000


@pytest.mark.parametrize(
    ("function", "count"), [(work.wait_until_asked, 6), (work.never_listen, 1)]
)
def test_a_stop_ends_the_work_whether_tasks_listen_or_not(pool, tmp_path, function, count):
    signs = [str(tmp_path / str(number)) for number in range(count)]
    asked = itertools.count()
    assert outcome_of(pool, function, signs, lambda: next(asked) > 10) == {}
    assert outcome_of(pool, work.square, [7])[7].result == 49


def test_a_worker_that_starts_never_hears_of_a_task_that_is_given_up(tmp_path):
    sign = tmp_path / "sign"
    with ProcessExecutor(1) as executor:
        is_asked = itertools.count()

        def has_asked_one():
            return next(is_asked) > 0 and executor._workers[0] is not None

        assert outcome_of(executor, work.leave_a_sign_for_ever, [str(sign)], has_asked_one) == {}
        assert outcome_of(executor, work.square, [7])[7].result == 49
    assert not sign.exists()


def test_a_task_that_tells_how_far_it_is_all_the_time_hears_that_it_is_to_stop():
    tasks = SingleTasks(WorkerLimits.shared_by(1))
    shares = []
    assert tasks.do(work.report_until_asked, 0, lambda: len(shares) > 5, shares.append) == "asked"
    tasks.close()


def test_a_task_that_does_not_stop_is_killed_and_its_process_waited_for(monkeypatch, tmp_path):
    started, sign = [], tmp_path / "sign"

    def start(*options):
        started.append(WorkerProcess(*options))
        return started[-1]

    monkeypatch.setattr(single, "WorkerProcess", start)
    tasks = SingleTasks(WorkerLimits.shared_by(1))
    with pytest.raises(WorkerDiedError, match="did not finish within 1 s of the request"):
        tasks.do(work.leave_a_sign_for_ever, str(sign), sign.exists)
    assert started[0]._process.returncode == -signal.SIGKILL
    tasks.close()


def test_a_worker_that_was_paused_is_not_ended_for_the_time_it_stood_still(monkeypatch):
    now = 100.0
    monkeypatch.setattr(awake_clock, "time", SimpleNamespace(monotonic=lambda: now))
    clock = AwakeClock()
    now += 1.0
    assert clock.read() == 1.0
    now += 3600.0
    assert clock.read() == 1.0 + LONGEST_GAP


def test_leaving_the_iteration_frees_the_workers(pool):
    endless = pool.map(work.square, itertools.count(), should_stop=go_on)
    assert {next(endless).result for _ in range(10)} <= {k * k for k in range(AHEAD)}
    endless.close()
    assert outcome_of(pool, work.square, [7])[7].result == 49


def test_a_worker_that_starts_while_another_gives_up_harms_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(processes, "_GIVING_UP", PATIENCE)
    with ProcessExecutor(2) as executor:
        sign = tmp_path / "sign"

        def hold_the_second():
            """Lets the first do its task alone until the work is given up."""
            wait_until(lambda: executor._workers[1] is not None)
            second = executor._workers[1]
            second._process.send_signal(signal.SIGSTOP)
            asked_to_stop.wait()
            second._process.send_signal(signal.SIGCONT)
            wait_until(lambda: second.ready)
            time.sleep(0.2)  # so that its answer, which follows, has come too
            sign.unlink()

        def should_stop():
            if sign.exists():
                asked_to_stop.set()
            return asked_to_stop.is_set()

        asked_to_stop = threading.Event()
        holder = threading.Thread(target=hold_the_second)
        holder.start()
        tasks = [(0, str(sign)), (1, None), (2, None), (3, None)]
        assert outcome_of(executor, work.end_after_the_others, tasks, should_stop) == {}
        holder.join()
        assert outcome_of(executor, work.square, [7])[7].result == 49


def test_tasks_are_taken_only_as_the_oldest_unfinished_one_allows(pool, tmp_path):
    taken, silence = [], itertools.count()
    tasks = (taken.append(k) or (k, str(tmp_path / "sign") if k == 0 else None) for k in range(999))

    def nothing_more_is_done():
        return len(done) >= AHEAD - 2 and next(silence) > 20

    done = []
    for result in pool.map(work.wait_for_the_first, tasks, should_stop=nothing_more_is_done):
        done.append(result.task[0])
    assert 0 not in done
    assert len(taken) == AHEAD


def test_a_second_caller_is_told_to_wait(pool):
    first = pool.map(work.square, range(3), should_stop=go_on)
    next(first)
    with pytest.raises(ExecutorError, match="in use by another caller"):
        list(pool.map(work.square, range(3), should_stop=go_on))
    first.close()


def test_a_function_of_the_script_itself_is_refused(pool, monkeypatch):
    monkeypatch.setattr(work.square, "__module__", "__main__")
    with pytest.raises(ExecutorError, match="move it into a module"):
        list(pool.map(work.square, [1], should_stop=go_on))


def test_workers_that_cannot_start_are_an_error_and_no_endless_loop(monkeypatch):
    monkeypatch.setattr(sys, "executable", shutil.which("false"))
    with (
        make_executor("processes", workers=1) as executor,
        pytest.raises(ExecutorError, match="ended with exit status 1 before its first task"),
    ):
        list(executor.map(work.square, [1], should_stop=go_on))


def test_workers_killed_as_soon_as_they_start_cost_only_time():
    with ProcessExecutor(2) as executor:
        killed = []

        def kill_six():
            while len(killed) < 6:
                for worker in executor._workers:
                    if worker is not None and not worker.ready and worker not in killed:
                        worker.kill()
                        killed.append(worker)
                time.sleep(0.01)

        killer = threading.Thread(target=kill_six)
        killer.start()
        found = outcome_of(executor, work.square, range(5))
        killer.join()
    assert {task: done.result for task, done in found.items()} == {n: n * n for n in range(5)}


def test_a_closed_engine_starts_no_workers():
    executor = make_executor("processes", workers=1)
    executor.close()
    with pytest.raises(ExecutorError, match="have been stopped"):
        list(executor.map(work.square, [1], should_stop=go_on))


def test_a_killed_script_leaves_no_workers_behind_and_needs_no_main_guard(tmp_path):
    script, sign = tmp_path / "script.py", tmp_path / "sign"
    script.write_text(SCRIPT)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, str(script), str(sign)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None
        worker = int(process.stdout.readline())
        wait_until(sign.exists)
        process.kill()
    wait_until(lambda: not is_alive(worker))


def is_alive(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    status = Path(f"/proc/{process}/stat")
    # Where nobody waits for orphans, they stay as zombies.
    return not (status.exists() and status.read_text().rpartition(")")[2].split()[0] == "Z")


@pytest.mark.parametrize(
    ("specification", "workers", "words"),
    [
        ("threads", None, "'threads' is not an executor; choose one of processes, inline, dask"),
        ("dask://", None, "is not an executor"),
        ("dask://host:port", None, "is not an executor"),
        ("", None, "'' is not an executor"),
        ("x" * 1000, None, "x' is not an executor"),
        ("processes", 0, "0 workers are not possible; allowed: 1 … 1024"),
        ("processes", 2000, "2000 workers are not possible"),
        ("dask", 0, "0 workers are not possible"),
        ("inline", 2, "'inline' has a fixed number of workers"),
        ("dask://localhost:8786", 2, "has a fixed number of workers"),
    ],
)
def test_what_is_no_engine_is_refused_in_one_sentence(specification, workers, words):
    with pytest.raises(ExecutorError) as caught:
        make_executor(specification, workers=workers)
    assert words in str(caught.value) and len(str(caught.value)) < 200


def test_dask_that_is_not_installed_is_said_so(monkeypatch):
    monkeypatch.setattr("slipgrasp.core.executors.dask_cluster.find_spec", lambda name: None)
    with pytest.raises(ExecutorError, match=r"pip install 'slipgrasp\[dask\]'"):
        make_executor("dask")


def test_as_many_workers_as_processors_by_default():
    assert make_executor("processes").num_workers == len(os.sched_getaffinity(0))
