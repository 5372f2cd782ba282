"""Which frames of a viewer reach viser."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import msgspec
import pytest
import viser._messages as messages
from websockets.exceptions import ConnectionClosed

from slipgrasp.server.app import create_app
from slipgrasp.server.viewer.frame_filter import LIMITS, PART, START, FrameFilter
from slipgrasp.server.viewer.relay import add_viewer_routes
from tests.server.serving import patient_settings, serve
from tests.server.test_viewer_relay import connect

MEGABYTE = 1 << 20


def frame(kind: Any, **content: Any) -> bytes:
    return msgspec.msgpack.encode({"type": kind, **content})


def start(transfer: str, size: int) -> bytes:
    return frame(START, transfer_uuid=transfer, size_bytes=size)


def part(transfer: str, size: int) -> bytes:
    return frame(PART, transfer_uuid=transfer, content=bytes(size))


def test_every_kind_that_may_pass_is_one_of_viser() -> None:
    assert all(hasattr(messages, kind) for kind in LIMITS)


def test_what_the_page_sends_passes() -> None:
    faults = FrameFilter()
    assert faults.find_fault(frame("GuiUpdateMessage", uuid="a", updates={"value": 1})) == ""
    for i in range(20):
        assert faults.find_fault(start(f"{i}", MEGABYTE)) == ""
        assert faults.find_fault(part(f"{i}", MEGABYTE // 2)) == ""
        assert faults.find_fault(part(f"{i}", MEGABYTE // 2)) == ""
        faults = FrameFilter() if i == 10 else faults


@pytest.mark.parametrize(
    "sent",
    [b"", b"\xc1", b"\x91" * 5000, b"\x01", frame(1), frame([]), frame("SetOrientationMessage")],
)
def test_what_is_no_message_that_is_listened_to_does_not_pass(sent: bytes) -> None:
    assert FrameFilter().find_fault(sent)


def test_a_long_message_does_not_pass() -> None:
    assert FrameFilter().find_fault(frame("GuiUpdateMessage", updates={"value": "x" * 70_000}))
    assert FrameFilter().find_fault(part("a", MEGABYTE))


def test_files_on_their_way_are_bounded() -> None:
    faults = FrameFilter()
    for i in range(4):
        assert faults.find_fault(start(f"{i}", 1000)) == ""
    assert faults.find_fault(start("5", 1000)) == "the files are too large"
    assert faults.find_fault(part("0", 1001)) == "the files are too large"
    assert FrameFilter().find_fault(start("0", 17 * MEGABYTE)) == "the files are too large"
    assert FrameFilter().find_fault(part("never announced", 10))


@pytest.mark.slow
def test_a_viewer_whose_frames_do_not_pass_is_told_and_closed(viewing, tmp_path: Path) -> None:
    settings = patient_settings(tmp_path)
    app = create_app(settings)
    port = viewing.viewer.get_port
    add_viewer_routes(app, port, find_faults=lambda: FrameFilter().find_fault)

    async def closed() -> tuple[int, str]:
        async with connect(running.port) as viewer:
            await viewer.send(b"\xc1")
            with pytest.raises(ConnectionClosed) as ended:
                while True:
                    await viewer.recv()
        received = ended.value.rcvd
        assert received is not None
        return received.code, received.reason

    with serve(settings, app) as running:
        assert asyncio.run(closed()) == (1008, "a message cannot be read")
