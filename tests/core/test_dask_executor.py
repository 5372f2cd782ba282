"""The same on a Dask cluster: a scheduler and two workers, started as a user starts them."""

import itertools
import os
import socket
import subprocess
import sys
from contextlib import ExitStack, contextmanager

import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.executors import AHEAD, ExecutorError, make_executor
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.study.loading import study_from_mapping
from slipgrasp.recordings.study.scheduler import schedule_runs
from slipgrasp.recordings.study.writer import StudyWriter
from tests.core import executor_tasks as work
from tests.core.test_executors import go_on, outcome_of
from tests.waiting import PATIENCE, wait_until

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("kernel")]

CLIENT = """
import sys
from slipgrasp.core.executors import make_executor
from tests.core.executor_tasks import wait_until_asked

executor = make_executor(sys.argv[1])
list(executor.map(wait_until_asked, sys.argv[2:], should_stop=lambda: False))
"""


STUDY = {
    "base": "paper-case-2",
    "sampling": {"method": "random", "runs": 25, "seed": 5},
    "recordings": "ended-early",
    "vary": {
        "fingers.*.friction": {"min": 0.1, "max": 0.6},
        "simulation.duration": {"min": 0.1, "max": 0.3},
        "controller.lyapunov_weight": {"values": [1.0, 20.0]},
    },
}


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextmanager
def started(folder, *arguments):
    """A command of Dask, run in another folder than this process."""
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(sys.path),
        "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0",
        # Dask takes workers for dead by the wall clock, which somebody may set.
        "DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": "None",
        "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "2s",
    }
    command = [sys.executable, "-m", "dask", *arguments, "--no-dashboard"]
    process = subprocess.Popen(command, cwd=folder, env=environment, stderr=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.terminate()
        process.wait(PATIENCE)


def start_scheduler(stack, folder):
    port = free_port()
    command = "scheduler", "--host", "127.0.0.1", "--port", str(port), "--dashboard-address", ":0"
    scheduler = stack.enter_context(started(folder, *command))

    def listens():
        assert scheduler.poll() is None
        with socket.socket() as probe:
            return probe.connect_ex(("127.0.0.1", port)) == 0

    wait_until(listens)
    return scheduler, port


def start_workers(stack, folder, port, *arguments):
    command = "worker", f"tcp://127.0.0.1:{port}", "--nthreads", "1", *arguments
    stack.enter_context(started(folder, *command))


@pytest.fixture(scope="module", autouse=True)
def patience():
    """Lets a busy machine take its time to start workers."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("slipgrasp.core.executors.dask_connection._PATIENCE", PATIENCE)
        patch.setattr("slipgrasp.core.executors.dask_connection._WORKERS_PATIENCE", PATIENCE)
        yield


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """Where the scheduler of two workers listens."""
    folder = tmp_path_factory.mktemp("dask")
    with ExitStack() as stack:
        _, port = start_scheduler(stack, folder)
        start_workers(stack, folder, port, "--nworkers", "2")
        yield f"dask://127.0.0.1:{port}"


@pytest.fixture(scope="module")
def dask(cluster):
    with make_executor(cluster) as executor:
        executor.prepare()
        yield executor


def test_a_study_is_the_same_file_on_every_engine(dask, tmp_path):
    study = study_from_mapping(STUDY, load_scenario)
    with make_executor("processes", workers=1) as pool:
        engines = {"inline": make_executor("inline"), "processes": pool, "dask": dask}
        found = [scheduled(study, engines[name], tmp_path / name) for name in engines]
    assert found[0] == found[1] == found[2]
    _, recordings, outcomes = found[0]
    assert len(outcomes) > 1 and 0 < len(recordings) < study.num_runs


def scheduled(study, executor, path):
    """The file of a study, the recordings that are kept of it, and how its runs ended."""
    recordings = {}

    def keep(member):
        name = f"run-{member.row.index}"
        recordings[name] = member.recording.data
        return name

    with StudyWriter(path, study) as writer:
        end = schedule_runs(
            study, executor, writer, should_stop=go_on, watch=lambda row: None, keep=keep
        )
        writer.finish(end)
    return path.read_bytes(), recordings, end.outcomes


def test_every_task_is_done_once_and_only_a_window_is_taken(dask):
    taken = itertools.count()
    tasks = (k for k in range(200) if next(taken) >= 0)
    found, ahead = {}, 0
    for done in dask.map(work.square, tasks, should_stop=go_on):
        found[done.task] = done.result
        oldest = next(k for k in itertools.count() if k not in found)
        ahead = max(ahead, done.task - oldest)
    assert found == {k: k * k for k in range(200)}
    assert ahead < AHEAD


def test_an_error_of_the_function_comes_back_as_it_was(dask):
    with pytest.raises(ScenarioError, match=r"^\d is odd") as caught:
        list(dask.map(work.refuse_odd, range(10), should_stop=go_on))
    assert caught.value.errors[0].field == "object.mass"
    assert "in refuse_odd" in caught.value.__notes__[0]


def test_a_stop_makes_the_workers_give_up(dask, tmp_path):
    signs = [str(tmp_path / name) for name in "ab"]

    def both_are_at_work():
        return all(map(os.path.exists, signs))

    assert outcome_of(dask, work.wait_until_asked, signs, both_are_at_work) == {}
    assert outcome_of(dask, work.square, [7])[7].result == 49


def test_the_work_of_a_killed_client_is_given_up(cluster, dask, tmp_path):
    script, signs = tmp_path / "client.py", [tmp_path / name for name in "ab"]
    script.write_text(CLIENT)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, str(script), cluster, *map(str, signs)]
    with subprocess.Popen(command, env=environment) as client:
        wait_until(lambda: all(sign.exists() for sign in signs) or client.poll() is not None)
        assert client.poll() is None
        client.kill()
    assert outcome_of(dask, work.square, [7])[7].result == 49


def test_a_task_that_always_kills_its_worker_fails_and_the_others_finish(dask, tmp_path):
    deaths = tmp_path / "deaths"
    deaths.write_text("xxxxx")
    tasks = [(number, str(deaths) if number == 5 else None) for number in range(20)]
    done = outcome_of(dask, work.die_as_told, tasks)
    failed = {finished.task[0]: finished.failure for finished in done.values() if finished.failure}
    assert failed == {5: "its worker died 3 times"}
    assert len(done) == 20 and len(deaths.read_text()) == 2


def test_a_worker_of_another_version_is_refused_by_name(cluster, monkeypatch):
    monkeypatch.setattr("platform.python_version_tuple", lambda: ("3", "0", "1"))
    with (
        make_executor(cluster) as executor,
        pytest.raises(ExecutorError, match=r"tcp://.* has another version of Python \(3\.\d+\)"),
    ):
        executor.prepare()


def test_a_scheduler_that_is_missing_idle_or_lost_is_said_so(tmp_path, monkeypatch):
    with (
        monkeypatch.context() as hasty,
        make_executor(f"dask://127.0.0.1:{free_port()}") as executor,
    ):
        hasty.setattr("slipgrasp.core.executors.dask_connection._PATIENCE", 0.3)
        with pytest.raises(ExecutorError, match="no Dask scheduler responds at tcp://127"):
            list(executor.map(work.square, [1], should_stop=go_on))
    with ExitStack() as stack:
        scheduler, port = start_scheduler(stack, tmp_path)
        executor = stack.enter_context(make_executor(f"dask://127.0.0.1:{port}"))
        with monkeypatch.context() as hasty:
            hasty.setattr("slipgrasp.core.executors.dask_connection._WORKERS_PATIENCE", 0.3)
            with pytest.raises(ExecutorError, match="has no workers; start some with 'dask worker"):
                executor.prepare()
        start_workers(stack, tmp_path, port, "--no-nanny")
        endless = executor.map(work.square, itertools.count(), should_stop=go_on)
        next(endless)
        scheduler.kill()
        with pytest.raises(ExecutorError, match=r"connection to the Dask scheduler .* is lost"):
            for _ in endless:
                pass


def test_a_cluster_on_this_machine_is_started_and_ended():
    with make_executor("dask", workers=1) as executor:
        assert outcome_of(executor, work.square, range(3)).keys() == {0, 1, 2}
        assert executor.num_workers == 1
