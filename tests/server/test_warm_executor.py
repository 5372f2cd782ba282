"""Workers stay warm from one study to the next, but not for ever."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import pytest

from slipgrasp.core.executors import ExecutorError, make_executor
from slipgrasp.server.studies.runner import WarmExecutor

INLINE = partial(make_executor, "inline")


@dataclass
class HandTimer:
    """A timer that goes off when the test wants it to."""

    seconds: float
    function: Callable[[], None]
    is_running: bool = False

    def start(self):
        self.is_running = True

    def cancel(self):
        self.is_running = False


@pytest.fixture
def timers(monkeypatch):
    """All timers that were made."""
    made = []

    def make(seconds, function):
        made.append(HandTimer(seconds, function))
        return made[-1]

    monkeypatch.setattr(threading, "Timer", make)
    return made


def used(warm):
    with warm.use() as executor:
        return executor


def test_the_next_study_has_the_workers_of_the_last():
    warm = WarmExecutor(INLINE)

    assert used(warm) is used(warm)
    warm.close()


def test_idle_workers_are_ended_and_made_again(timers):
    warm = WarmExecutor(INLINE, idle_seconds=7.0)
    first = used(warm)

    assert [timer.seconds for timer in timers if timer.is_running] == [7.0]
    timers[-1].function()
    assert used(warm) is not first
    warm.close()
    assert not any(timer.is_running for timer in timers)


def test_workers_in_use_are_never_idle(timers):
    warm = WarmExecutor(INLINE)
    used(warm)

    with warm.use() as executor:
        assert not timers[-1].is_running
        # It was over in the moment in which it was to be cancelled.
        timers[-1].function()
    assert used(warm) is executor
    warm.close()


def test_after_an_error_the_next_study_has_other_workers():
    warm = WarmExecutor(INLINE)
    with pytest.raises(ExecutorError), warm.use() as first:
        raise ExecutorError("the scheduler is gone")

    assert used(warm) is not first
    warm.close()


def test_an_executor_that_there_is_not_is_told_when_it_is_needed():
    warm = WarmExecutor(partial(make_executor, "abacus"))

    with pytest.raises(ExecutorError, match="'abacus' is no executor"):
        used(warm)
    warm.close()
