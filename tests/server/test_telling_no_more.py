"""Answers and logs tell what is needed, and no more: no paths, no tracebacks."""

from __future__ import annotations

import asyncio
import logging
import os
import re

import msgspec
import pytest
import viser
import websockets.asyncio.client
from websockets.exceptions import ConnectionClosed

from slipgrasp.server.viewer.server import ViewerServer
from tests.server.serving import RunningServer, patient_settings, serve
from tests.waiting import wait_until

RUN = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.01}}


def test_damaged_files_are_told_by_their_name(tmp_path) -> None:
    (tmp_path / "studies").mkdir()
    for path in ("abcdefghijkl.mcap", "studies/abcdefghijkl.mcap"):
        (tmp_path / path).write_bytes(b"\x89MCAP0\r\n" + bytes(100))
    asked = [
        f"{kind}/abcdefghijkl{part}"
        for kind in ("/runs", "/studies")
        for part in ("", "/recording")
    ]
    asked += ["/runs", "/studies", "/runs/abcdefghijkl/signals", "/studies/abcdefghijkl/results"]
    with serve(patient_settings(tmp_path)) as running, running.client() as client:
        answers = [client.get(path) for path in asked]
        listed = client.get("/runs").json()["data"][0]
    assert "'abcdefghijkl.mcap'" in listed["title"] and "damaged" in listed["title"]
    for answer in answers:
        # Where a recording lies has a field of its own, for programs of this machine.
        told = re.sub(r'"recording":"[^"]*"', "", answer.text)
        assert str(tmp_path) not in told, answer.url


async def send(server: RunningServer, frame: bytes) -> None:
    address = f"ws://127.0.0.1:{server.port}/"
    async with websockets.asyncio.client.connect(
        address, subprotocols=[f"viser-v{viser.__version__}"], max_size=None, proxy=None
    ) as viewer:
        await viewer.send(frame)
        # One that viser cannot read ends the connection, others are ignored.
        await viewer.send(b"\xc1")
        with pytest.raises(ConnectionClosed):
            while True:
                await viewer.recv()


@pytest.mark.parametrize(
    "frame",
    [
        b"",
        b"\xc1",
        b"\x00",
        b"not a message\nof any kind",
        msgspec.msgpack.encode([1, 2]),
        msgspec.msgpack.encode({"no": "type"}),
        msgspec.msgpack.encode({"type": "Unheard"}),
        msgspec.msgpack.encode({"type": "ViewerCameraMessage", "wxyz": "round"}),
        msgspec.msgpack.encode({"type": "GuiUpdateMessage", "uuid": "x", "updates": {"value": 1}}),
        msgspec.msgpack.encode({"type": "GuiUpdateMessage", "uuid": 7, "updates": 7}),
    ],
)
def test_a_malformed_frame_of_a_viewer_is_a_line_of_the_log(viewing, frame, caplog, capfd) -> None:
    with caplog.at_level(logging.INFO):
        asyncio.run(send(viewing.server, frame))
        wait_until(lambda: not viewing.viewer._websock_server._live_connections)
    assert all(record.exc_info is None for record in caplog.records)
    assert all("\n" not in record.getMessage() for record in caplog.records)
    assert 1 <= len(caplog.records) <= 3
    assert "Traceback" not in caplog.text + "".join(capfd.readouterr())


def test_the_environment_does_not_move_the_port_of_the_viewer(monkeypatch) -> None:
    monkeypatch.setenv("_VISER_PORT_OVERRIDE", "18999")
    viewer = ViewerServer()
    try:
        assert viewer.get_port() != 18999
    finally:
        viewer.stop()
    assert "_VISER_PORT_OVERRIDE" not in os.environ
