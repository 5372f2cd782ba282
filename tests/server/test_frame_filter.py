"""Which frames of a viewer reach viser."""

from __future__ import annotations

import asyncio
import dataclasses
from pathlib import Path
from typing import Any

import msgspec
import pytest
import viser._messages as messages
from websockets.exceptions import ConnectionClosed

from slipgrasp.server.app import create_app
from slipgrasp.server.viewer.frame_filter import FrameFilter
from slipgrasp.server.viewer.messages import MESSAGES
from slipgrasp.server.viewer.relay import add_viewer_routes
from tests.server.serving import patient_settings, serve
from tests.server.test_viewer_relay import connect

MEGABYTE = 1 << 20
HALF = MEGABYTE // 2


def frame(kind: Any, **content: Any) -> bytes:
    return msgspec.msgpack.encode({"type": kind, **content})


def start(transfer: str, size: int, parts: int = 2) -> bytes:
    return frame(
        "FileTransferStartUpload",
        source_component_uuid="button",
        transfer_uuid=transfer,
        filename="scenario.toml",
        mime_type="",
        part_count=parts,
        size_bytes=size,
    )


def part(transfer: str, index: int, size: int) -> bytes:
    return frame(
        "FileTransferPart",
        source_component_uuid="button",
        transfer_uuid=transfer,
        part_index=index,
        content=bytes(size),
    )


def update(**updates: Any) -> bytes:
    return frame("GuiUpdateMessage", uuid="a", updates=updates)


def test_messages_that_may_pass_carry_what_viser_declares() -> None:
    for message in MESSAGES:
        declared = dataclasses.fields(getattr(messages, message.__name__))
        passing = [field.name for field in msgspec.structs.fields(message)]
        assert passing == [field.name for field in declared], message.__name__


@pytest.mark.parametrize("value", [True, 3, 0.5, "paper-case-1", [0.1, 0.2, 0.3]])
def test_the_value_of_a_control_passes(value: Any) -> None:
    assert FrameFilter().find_fault(update(value=value)) == ""


def test_files_that_are_sent_whole_pass() -> None:
    faults = FrameFilter()
    for i in range(20):
        assert faults.find_fault(start(f"{i}", MEGABYTE)) == ""
        assert faults.find_fault(part(f"{i}", 1, HALF)) == ""
        assert faults.find_fault(part(f"{i}", 0, HALF)) == ""


@pytest.mark.parametrize(
    "sent",
    [
        update(update_cb=[0] * 60_000),
        update(value=1, update_cb=[0]),
        update(props={"value": 1}),
        update(removed=True),
        update(value={"a": 1}),
        update(value=None),
        update(value=[[0.0]]),
        update(value=[0.0] * 1000),
        update(),
        frame("GuiUpdateMessage", uuid=1, updates={"value": 1}),
        frame("GuiUpdateMessage", uuid="a", updates={"value": 1}, excluded_self_client=1),
        frame("CommandTriggerMessage", uuid=["a"]),
        frame("ViewerCameraMessage", wxyz=[1.0]),
    ],
)
def test_what_no_control_can_carry_does_not_pass(sent: bytes) -> None:
    assert FrameFilter().find_fault(sent) == "a message cannot be read"


@pytest.mark.parametrize(
    "sent",
    [b"", b"\xc1", b"\x91" * 5000, b"\x01", frame(1), frame([]), frame("SetOrientationMessage")],
)
def test_what_is_no_message_that_is_listened_to_does_not_pass(sent: bytes) -> None:
    assert FrameFilter().find_fault(sent)


def test_a_long_message_does_not_pass() -> None:
    assert FrameFilter().find_fault(update(value="x" * 60_000)) == ""
    assert FrameFilter().find_fault(update(value="x" * 70_000)) == "a message is too long"
    assert FrameFilter().find_fault(part("a", 0, MEGABYTE)) == "a message is too long"


def test_files_on_their_way_are_bounded() -> None:
    faults = FrameFilter()
    for i in range(4):
        assert faults.find_fault(start(f"{i}", 1000)) == ""
    assert faults.find_fault(start("5", 1000)) == "the files are too large"
    assert faults.find_fault(part("0", 0, 1001)) == "the files are too large"
    assert FrameFilter().find_fault(start("0", 17 * MEGABYTE)) == "the files are too large"
    assert FrameFilter().find_fault(start("0", MEGABYTE, 2**31)) == "the files are too large"
    assert FrameFilter().find_fault(part("never announced", 0, 10))


@pytest.mark.parametrize("size", [0, HALF - 1])
def test_a_file_does_not_pass_whose_parts_are_not_those_announced(size: int) -> None:
    faults = FrameFilter()
    assert faults.find_fault(start("0", MEGABYTE)) == ""
    assert faults.find_fault(part("0", 0, HALF)) == ""
    assert faults.find_fault(part("0", 0, HALF)) == "a message cannot be read"
    assert faults.find_fault(part("0", 2, HALF)) == "a message cannot be read"
    assert faults.find_fault(part("0", 1, size)) == "a message cannot be read"
    assert FrameFilter().find_fault(start("0", MEGABYTE, 0)) == "a message cannot be read"


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
