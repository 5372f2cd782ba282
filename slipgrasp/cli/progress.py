"""Progress on standard error for commands that take longer than a second."""

from __future__ import annotations

import sys
import time
from functools import partial
from threading import Lock, Timer
from types import TracebackType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from slipgrasp.core.scenario import Scenario
    from slipgrasp.core.scenario.space import Space

_SUBJECTS = {"planar": "planar hands", "spatial": "spatial hands", "support": "slides"}

PATIENCE = 1.0
REFRESH_PERIOD = 0.1
LINE_PERIOD = 10.0
"""Time between lines of progress without a terminal [s]."""

BAR_WIDTH = 24


class Progress:
    """Shows progress: an updated line in a terminal, single lines elsewhere.

    Nothing is printed for operations shorter than a second.

    Args:
        text: Name of the operation.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._fraction: float | None = None
        self._details = ""
        self._announced = False
        self._next_refresh = 0.0
        self._lock = Lock()
        self._timer = Timer(PATIENCE, self.announce)
        self._timer.daemon = True

    def __enter__(self) -> Self:
        self._timer.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._timer.cancel()
        with self._lock:
            if self._announced and sys.stderr.isatty():
                print("\r\033[K", end="", file=sys.stderr, flush=True)
            self._announced = True

    def announce(self, text: str | None = None) -> None:
        """Prints the line now.

        Args:
            text: Name of the operation, if it has changed.
        """
        with self._lock:
            if text is not None:
                self._text = text
            elif self._announced:
                return
            self._announced = True
            self._print()

    def update(self, fraction: float, details: str = "") -> None:
        """Sets the progress.

        Args:
            fraction: Completed fraction, 0 … 1.
            details: Rate and remaining time of operations that take minutes: shown with a bar, and
                without a terminal as occasional lines.
        """
        with self._lock:
            self._fraction = fraction
            self._details = details
            is_wanted = bool(details) or sys.stderr.isatty()
            if self._announced and is_wanted and time.monotonic() >= self._next_refresh:
                self._print()

    def _print(self) -> None:
        period = REFRESH_PERIOD if sys.stderr.isatty() else LINE_PERIOD
        self._next_refresh = time.monotonic() + period
        done = "" if self._fraction is None else f": {self._fraction:.0%}"
        if self._fraction is not None and self._details:
            bar = f"{_bar(self._fraction)} " if sys.stderr.isatty() else ""
            done = f": {bar}{self._fraction:.0%}, {self._details}"
        start, end = ("\r", "\033[K") if sys.stderr.isatty() else ("", "\n")
        print(f"{start}slipgrasp: {self._text}{done}", end=end, file=sys.stderr, flush=True)


def _bar(fraction: float) -> str:
    full = round(BAR_WIDTH * min(max(fraction, 0.0), 1.0))
    return "█" * full + "░" * (BAR_WIDTH - full)


def compiling_words(space: Space) -> str:
    """What the program does before its first run with a kind of hand, and for how long."""
    return (
        f"compiling the simulation of {_SUBJECTS[space.name]} for this processor, once; that takes "
        "half a minute to two minutes, longer on a busy machine"
    )


def load_simulation(scenario: Scenario) -> None:
    """Waits until runs can start; shows progress and remaining time while compiling.

    Args:
        scenario: The runs have its kind of hand, each of which is compiled separately, and its law.
    """
    with Progress("loading the simulation") as progress:
        from slipgrasp.core.run.simulator import (
            kernel_is_cached,
            kernel_progress,
            prepare_kernel,
        )
        from slipgrasp.core.scenario.chosen_laws import custom_kind_in
        from slipgrasp.server.runs.preparation import Preparation, time_to_go

        space, is_custom = scenario.space, custom_kind_in(scenario) is not None
        if kernel_is_cached(space, machine_code=is_custom):
            return prepare_kernel(None, space, machine_code=is_custom)
        progress.announce(compiling_words(space))
        preparation = Preparation(partial(kernel_progress, machine_code=is_custom))
        preparation.look()

        def show(share: float) -> None:
            progress.update(share, time_to_go(preparation.look()[1]))

        prepare_kernel(show, space, machine_code=is_custom)
