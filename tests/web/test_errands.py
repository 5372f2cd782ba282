"""The thread that runs the errands of one concern."""

from __future__ import annotations

import logging
import threading

import pytest

from slipgrasp.web.workers.errands import Errands
from tests.waiting import PATIENCE


@pytest.fixture
def errands() -> Errands:
    return Errands("errands of a test")


def test_an_errand_that_fails_does_not_end_those_that_follow(
    errands: Errands, caplog: pytest.LogCaptureFixture
) -> None:
    done = threading.Event()
    with caplog.at_level(logging.ERROR):
        errands.ask(lambda: {}["no such key"])
        errands.ask(done.set)
        assert done.wait(PATIENCE)
    assert "an errand of the thread errands of a test failed" in caplog.text
    errands.close()
    errands.join(10.0)


def test_what_must_be_done_is_done_before_the_thread_ends(errands: Errands) -> None:
    going_on, go_on, told = threading.Event(), threading.Event(), []

    def first() -> None:
        going_on.set()
        assert go_on.wait(PATIENCE)

    errands.ask(first)
    assert going_on.wait(PATIENCE)
    errands.ask(lambda: told.append("looked up"))
    errands.ask(lambda: told.append("written"), must=True)
    errands.close()
    go_on.set()
    errands.join(10.0)
    assert told == ["written"]
