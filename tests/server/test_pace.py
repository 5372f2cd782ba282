"""How fast frames of a viewer are read: as fast as a page sends them, and no faster."""

import pytest

from slipgrasp.server.viewer.pace import (
    BURST_SECONDS,
    BYTES_PER_SECOND,
    FRAMES_PER_SECOND,
    Pace,
)


class Clock:
    """Time passes only while somebody waits."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def read(frames: int, num_bytes: int, between: float = 0.0) -> float:
    """How long it takes to read frames of a length, sent with pauses [s]."""
    clock = Clock()
    pace = Pace(clock)
    for _ in range(frames):
        clock.now += between + pace.count(num_bytes)
    return clock.now


def test_a_page_that_is_dragged_in_never_waits() -> None:
    assert read(1000, 500, between=0.02) == pytest.approx(20.0)


def test_what_a_line_held_back_for_seconds_is_read_at_once() -> None:
    assert read(round(FRAMES_PER_SECOND * BURST_SECONDS), 500) == 0.0


def test_a_flood_is_read_at_its_rate() -> None:
    assert read(20_000, 500) == pytest.approx(20_000 / FRAMES_PER_SECOND - BURST_SECONDS)


def test_large_frames_are_read_by_their_bytes() -> None:
    length = 512 << 10
    assert read(200, length) == pytest.approx(200 * length / BYTES_PER_SECOND - BURST_SECONDS)
