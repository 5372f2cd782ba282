"""Workers stay warm from one study to the next, but not for ever."""

from __future__ import annotations

import time
from functools import partial

import pytest

from core.executors import ExecutorError, make_executor
from server.warm_executor import WarmExecutor

INLINE = partial(make_executor, "inline")


def used(warm):
    with warm.use() as executor:
        return executor


def test_the_next_study_has_the_workers_of_the_last():
    warm = WarmExecutor(INLINE)

    assert used(warm) is used(warm)
    warm.close()


def test_idle_workers_are_ended_and_made_again():
    warm = WarmExecutor(INLINE, idle_seconds=0.05)
    first = used(warm)
    patience = time.monotonic() + 10.0

    time.sleep(0.2)
    while used(warm) is first:
        assert time.monotonic() < patience
        time.sleep(0.2)
    warm.close()


def test_workers_in_use_are_never_idle():
    warm = WarmExecutor(INLINE, idle_seconds=0.02)
    used(warm)

    with warm.use() as executor:
        time.sleep(0.1)
        with_workers = executor
    assert used(warm) is with_workers
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
