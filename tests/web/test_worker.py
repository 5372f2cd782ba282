"""The thread that runs the tasks of one concern."""

from __future__ import annotations

import logging
import threading

import pytest

from slipgrasp.web.workers.worker import QueueWorker
from tests.waiting import PATIENCE


@pytest.fixture
def worker() -> QueueWorker:
    return QueueWorker("tasks of a test")


def test_a_task_that_fails_does_not_end_those_that_follow(
    worker: QueueWorker, caplog: pytest.LogCaptureFixture
) -> None:
    done = threading.Event()
    with caplog.at_level(logging.ERROR):
        worker.ask(lambda: {}["no such key"])
        worker.ask(done.set)
        assert done.wait(PATIENCE)
    assert "a task of the thread tasks of a test failed" in caplog.text
    worker.close()
    worker.join(10.0)


def test_what_must_be_done_is_done_before_the_thread_ends(worker: QueueWorker) -> None:
    going_on, go_on, told = threading.Event(), threading.Event(), []

    def first() -> None:
        going_on.set()
        assert go_on.wait(PATIENCE)

    worker.ask(first)
    assert going_on.wait(PATIENCE)
    worker.ask(lambda: told.append("looked up"))
    worker.ask(lambda: told.append("written"), must=True)
    worker.close()
    go_on.set()
    worker.join(10.0)
    assert told == ["written"]


def test_a_worker_without_tasks_has_no_thread() -> None:
    before = threading.active_count()
    worker = QueueWorker("never used")
    assert threading.active_count() == before
    worker.close()
    worker.join(10.0)


def test_a_closed_worker_has_no_thread_either(worker: QueueWorker) -> None:
    before, done = threading.active_count(), []
    worker.close()
    worker.ask(lambda: done.append("asked after the end"))
    assert threading.active_count() == before
    worker.join(10.0)
    assert done == []
