"""What all tests share: the clock, the browser, and how the processes they start are to behave."""

from __future__ import annotations

import gc
import os
import random
import signal
from collections.abc import Generator, Iterator
from datetime import datetime, timedelta, tzinfo
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

from tests.ensure_programs import FLAGS, HOW_TO_FIX, find_chromium
from tests.waiting import PATIENCE

if TYPE_CHECKING:
    from playwright.sync_api import Browser

# The same examples every time: whether all is well must not depend on what is drawn. What may
# be found by drawing more are the seeded campaigns of the benchmarks.
settings.register_profile("same examples", derandomize=True)
settings.load_profile("same examples")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Lets a run take the tests in another order, which must not matter, or none be left out."""
    parser.addoption("--order-seed", type=int, help="shuffle the tests, the same for a seed")
    parser.addoption("--other-code", action="store_true", help="run what is marked other_code")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None]:
    """Collects without looking for garbage: ten thousand tests stay, and make a third of it."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leaves out what would find what it found before, and shuffles."""
    if not config.getoption("--other-code"):
        _skip_other_code([item for item in items if item.get_closest_marker("other_code")])
    seed = config.getoption("--order-seed")
    if seed is not None:
        _shuffle(items, seed)


def _skip_other_code(items: list[pytest.Item]) -> None:
    if not items:
        return
    from tests.other_code import has_passed

    if has_passed():
        for item in items:
            item.add_marker(pytest.mark.skip("passed with the same kernel: tests/other_code.py"))


def _shuffle(items: list[pytest.Item], seed: int) -> None:
    """Shuffles files, and the tests in each: what a file shares is set up once all the same."""
    source = random.Random(seed)
    source.shuffle(items)
    places = {path: source.random() for path in sorted({item.path for item in items})}
    items.sort(key=lambda item: places[item.path])


def pytest_sessionstart() -> None:
    """Makes ready what tests and the processes they start rely on."""
    # Hundreds of processes: each would compile all modules again.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    # A shell that starts the tests in the background makes them, and their processes, deaf.
    signal.signal(signal.SIGINT, signal.default_int_handler)


class ForwardClock(datetime):
    """The wall clock, save that it never goes back, as clocks do that are set right."""

    _last = datetime.min

    @classmethod
    def now(cls, tz: tzinfo | None = None) -> datetime:
        """Now, or a moment after the last answer."""
        now = datetime.now(tz)
        last = ForwardClock._last.replace(tzinfo=tz)
        ForwardClock._last = max(now, last + timedelta(milliseconds=1))
        return ForwardClock._last


@pytest.fixture(scope="session", autouse=True)
def clock() -> Iterator[None]:
    """What is made later is listed as newer: lists go by the moments written in recordings."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("slipgrasp.recordings.store.store.datetime", ForwardClock)
        patch.setattr("slipgrasp.recordings.store.job_store.datetime", ForwardClock)
        yield


@pytest.fixture(scope="session")
def kernel() -> None:
    """Compiles the simulation, for tests that start processes which are not to wait for it."""
    from slipgrasp.core.run.simulator import prepare_kernel

    prepare_kernel()


@pytest.fixture
def known_laws() -> Iterator[None]:
    """Forgets the custom laws of a test afterwards: lists of laws to choose from have them."""
    from slipgrasp.core.scenario.custom_laws import custom_laws, forget

    before = custom_laws()
    yield
    for law in custom_laws():
        if law not in before:
            forget(law.name)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A real Chromium; one, as Playwright allows no second at a time."""
    from playwright.sync_api import expect, sync_playwright

    chromium = find_chromium()
    if chromium is None:
        pytest.fail(HOW_TO_FIX)
    expect.set_options(timeout=1000 * PATIENCE)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=list(FLAGS))
        yield browser
        browser.close()
