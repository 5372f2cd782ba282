"""The relay between viewers and viser, with real websockets on both sides."""

from __future__ import annotations

import asyncio
import gc
import math
import os
import re
import time
from contextlib import ExitStack, suppress
from pathlib import Path

import msgspec
import pytest
import viser
import websockets.asyncio.client
import websockets.asyncio.server
from fastapi import FastAPI
from fastapi.testclient import TestClient
from websockets.exceptions import ConnectionClosed
from websockets.typing import Origin, Subprotocol

from slipgrasp.server.app import create_app
from slipgrasp.server.viewer.client_page import packed_page, unpack_page
from slipgrasp.server.viewer.relay import MAX_VIEWERS, add_viewer_routes
from tests.server.raw_http import get
from tests.server.serving import patient_settings, serve
from tests.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

PROTOCOL = f"viser-v{viser.__version__}"
HEAD = '<meta name="ours" />'


def connect(port: int, protocol: str | None = PROTOCOL, **options):
    return websockets.asyncio.client.connect(
        f"ws://127.0.0.1:{port}/",
        subprotocols=[Subprotocol(protocol)] if protocol else None,
        origin=Origin(f"http://127.0.0.1:{port}"),
        max_size=None,
        compression=None,
        proxy=None,
        **options,
    )


def num_connections(viewing) -> int:
    return len(viewing.viewer._websock_server._live_connections)


class Echo:
    """A server that sends back what it gets, in place of viser."""

    def __init__(self) -> None:
        self.open = 0
        self.port = 0

    async def answer(self, connection: websockets.asyncio.server.ServerConnection) -> None:
        self.open += 1
        try:
            async for message in connection:
                if message == b"close":
                    await connection.close(4321, "as you wish")
                await connection.send(message)
        finally:
            self.open -= 1

    async def listen(self) -> websockets.asyncio.server.Server:
        server = await websockets.asyncio.server.serve(
            self.answer,
            "127.0.0.1",
            0,
            max_size=None,
            compression=None,
            select_subprotocol=lambda _, offered: offered[0] if offered else None,
        )
        self.port = server.sockets[0].getsockname()[1]
        return server


def test_the_page_of_viser_is_served_with_the_files_that_it_names(viewing) -> None:
    port = viewing.server.port
    host = ("Host", f"localhost:{port}")
    answer = get(port, "/", [host])
    assert answer.status == 200 and answer.headers["content-type"].startswith("text/html")
    _page, style, code, decoder = unpack_page(packed_page())
    files = {"viser.css": style, "viser.js": code, "decoder.wasm": decoder}
    assert set(re.findall(rb"viser/([\w.]+)", answer.body)) == {name.encode() for name in files}
    for name, content in files.items():
        file = get(port, f"/viser/{name}", [host])
        assert file.status == 200 and file.body == content
        known = get(port, f"/viser/{name}", [host, ("If-None-Match", file.headers["etag"])])
        assert known.status == 304
    assert get(port, "/viser/other.js", [host]).status == 404


def test_a_page_that_is_packed_in_another_way_is_served_whole(monkeypatch) -> None:
    page = b"<html><head><script>other()</script></head></html>"
    monkeypatch.setattr("slipgrasp.server.viewer.relay.packed_page", lambda: page)
    app = FastAPI()
    add_viewer_routes(app, lambda: 0)
    assert TestClient(app).get("/").content == page


def test_a_viewer_is_given_what_viser_has_to_say(viewing) -> None:
    async def first_message() -> tuple[str | None, object]:
        async with connect(viewing.server.port) as viewer:
            return viewer.subprotocol, await viewer.recv()

    protocol, message = asyncio.run(first_message())
    assert protocol == PROTOCOL and isinstance(message, bytes) and len(message) > 16
    wait_until(lambda: num_connections(viewing) == 0)


@pytest.mark.parametrize("protocol", [None, "viser-v0.0.1"])
def test_a_viewer_of_another_version_is_told_so(viewing, protocol) -> None:
    async def reason() -> str:
        async with connect(viewing.server.port, protocol=protocol) as viewer:
            with pytest.raises(ConnectionClosed) as closed:
                await viewer.recv()
        received = closed.value.rcvd
        assert received is not None and received.code == 1002
        return received.reason

    assert "Version mismatch" in asyncio.run(reason())


def test_text_which_viser_does_not_know_is_refused(viewing) -> None:
    async def code() -> int:
        async with connect(viewing.server.port) as viewer:
            await viewer.send("text")
            with pytest.raises(ConnectionClosed) as closed:
                while True:
                    await viewer.recv()
        return closed.value.code if closed.value.rcvd is None else closed.value.rcvd.code

    assert asyncio.run(code()) == 1003
    wait_until(lambda: num_connections(viewing) == 0)


@pytest.fixture
def relayed(tmp_path):
    """An echo behind the relay, each in its own thread."""
    echo = Echo()
    settings = patient_settings(tmp_path)
    app = create_app(settings)
    app.state.relay = add_viewer_routes(app, lambda: echo.port, head=HEAD)
    with serve(settings, app) as running:
        yield echo, running


def test_messages_of_any_size_pass_both_ways_unchanged(relayed) -> None:
    echo, port = relayed[0], relayed[1].port

    async def exchange() -> list[object]:
        upstream = await echo.listen()
        async with upstream, connect(port) as viewer:
            answers = []
            for size in (0, 1, 125, 126, 65_535, 65_536, 5_000_000):
                message = os.urandom(size)
                await viewer.send(message)
                answers.append(await viewer.recv() == message)
            return answers

    assert all(asyncio.run(exchange()))


def test_of_where_a_viewer_looks_from_the_latest_is_passed_on_and_not_a_flood(
    relayed, monkeypatch
) -> None:
    monkeypatch.setattr("slipgrasp.server.viewer.relay.LOOK_SECONDS", 0.5)
    echo, port = relayed[0], relayed[1].port

    def look(number: int) -> bytes:
        return msgspec.msgpack.encode({"type": "ViewerCameraMessage", "fov": float(number)})

    async def exchange() -> list[bytes | str]:
        heard: list[bytes | str] = []
        async with await echo.listen(), connect(port) as viewer:
            for number in range(150):
                await viewer.send(look(number))
            await viewer.send(b"something else")
            while len(heard) < 2 or heard[-1] != look(149):
                heard.append(await viewer.recv())
        return heard

    heard = asyncio.run(exchange())
    assert heard[0] == look(0)
    assert b"something else" in heard
    assert len(heard) < 75


def test_the_reason_why_viser_closes_reaches_the_viewer(relayed) -> None:
    echo, port = relayed[0], relayed[1].port

    async def closing() -> tuple[int, str]:
        async with await echo.listen(), connect(port) as viewer:
            await viewer.send(b"close")
            with pytest.raises(ConnectionClosed) as closed:
                await viewer.recv()
        assert closed.value.rcvd is not None
        return closed.value.rcvd.code, closed.value.rcvd.reason

    assert asyncio.run(closing()) == (4321, "as you wish")


def test_viewers_that_come_and_go_leave_nothing_behind(relayed) -> None:
    echo, port = relayed[0], relayed[1].port

    async def churn(rounds: int) -> None:
        for i in range(rounds):
            viewer = await connect(port)
            await viewer.send(b"x" * 100_000)
            if i % 2:
                viewer.transport.abort()
            else:
                await viewer.recv()
                await viewer.close()

    async def compare() -> None:
        async with await echo.listen():
            await churn(10)
            await settle()
            before = num_open_files()
            await churn(60)
            await settle()
            await asyncio.to_thread(wait_until, lambda: num_open_files() <= before + 3)

    async def settle() -> None:
        await asyncio.to_thread(wait_until, lambda: echo.open == 0)
        gc.collect()

    asyncio.run(compare())


def num_open_files() -> int:
    return len(os.listdir("/dev/fd"))


def test_a_viewer_that_does_not_read_holds_up_nobody_else(relayed) -> None:
    echo, port = relayed[0], relayed[1].port

    async def exchange() -> bool:
        async with await echo.listen(), connect(port, max_queue=1) as stalled:
            sending = asyncio.create_task(flood(stalled))
            await asyncio.sleep(0.3)
            async with connect(port) as viewer:
                await viewer.send(b"hello")
                answer = await asyncio.wait_for(viewer.recv(), PATIENCE)
            sending.cancel()
            await asyncio.gather(sending, return_exceptions=True)
            stalled.transport.abort()
            return answer == b"hello"

    async def flood(viewer: websockets.asyncio.client.ClientConnection) -> None:
        while True:
            await viewer.send(b"x" * 100_000)

    assert asyncio.run(exchange())
    wait_until(lambda: echo.open == 0)


def test_what_is_ours_stands_first_in_the_head_of_the_page_in_place_of_viser_s_name(
    relayed,
) -> None:
    port = relayed[1].port
    page = get(port, "/", [("Host", f"localhost:{port}")]).body
    assert page.partition(b"<head>")[2].startswith(HEAD.encode())
    head, rest = page.replace(HEAD.encode(), b"").split(b"</head>", 1)
    shipped_head, shipped_rest = unpack_page(packed_page()).page.split(b"</head>", 1)
    assert rest == shipped_rest
    head = head.partition(b'<link rel="modulepreload"')[0]
    left_out = [line for line in shipped_head.splitlines() if line.strip() not in head]
    assert b"<title>" not in head and b'rel="icon"' not in head
    assert [line.split()[0].partition(b">")[0] for line in left_out] == [
        b"<link",
        b'rel="icon"',
        b'href="data:image/svg+xml,%3Csvg',
        b"<title",
    ]


def test_one_viewer_too_many_is_asked_to_try_later(relayed, monkeypatch) -> None:
    monkeypatch.setattr("slipgrasp.server.viewer.relay.FULL_SECONDS", math.inf)
    echo, port, relay = relayed[0], relayed[1].port, relayed[1].app.state.relay
    assert not relay.is_full

    async def crowd() -> tuple[int, bool]:
        async with await echo.listen():
            viewers = [await connect(port) for _ in range(MAX_VIEWERS)]
            async with connect(port) as late:
                with pytest.raises(ConnectionClosed) as closed:
                    await late.recv()
            await viewers[0].send(b"still here")
            served = await viewers[0].recv() == b"still here"
            for viewer in viewers:
                await viewer.close()
            async with connect(port) as next_one:
                await next_one.send(b"room again")
                served = served and await next_one.recv() == b"room again"
        assert closed.value.rcvd is not None
        return closed.value.rcvd.code, served

    assert asyncio.run(crowd()) == (1013, True)
    assert relay.is_full


def test_who_misbehaves_is_sent_away_each_time_and_others_are_served(
    tmp_path: Path, monkeypatch
) -> None:
    monkeypatch.setattr("slipgrasp.server.viewer.probation.FAULT_SECONDS", 0.2)
    echo = Echo()
    app = create_app(patient_settings(tmp_path))
    faults = lambda: lambda message: "bad" if message == b"bad" else ""  # noqa: E731
    add_viewer_routes(app, lambda: echo.port, find_faults=faults)

    async def closing_of_a_bad_one() -> int:
        async with connect(running.port) as viewer:
            with suppress(ConnectionClosed):
                await viewer.send(b"bad")
                while True:
                    await viewer.recv()
        assert viewer.close_code is not None
        return viewer.close_code

    async def crowd() -> tuple[list[int], bytes | str]:
        async with await echo.listen(), connect(running.port) as good:
            codes = [await closing_of_a_bad_one() for _ in range(5)]
            await good.send(b"still here")
            return codes, await good.recv()

    with serve(patient_settings(tmp_path), app) as running:
        began = time.monotonic()
        codes, answered = asyncio.run(crowd())
    assert codes == [1008] * 5
    assert time.monotonic() - began >= 4 * 0.2  # Each waits for its turn after the one before.
    assert answered == b"still here"


def test_a_viewer_is_asked_to_try_later_while_viser_is_away(relayed) -> None:
    port = relayed[1].port

    async def code() -> int:
        async with connect(port) as viewer:
            with pytest.raises(ConnectionClosed) as closed:
                await viewer.recv()
        assert closed.value.rcvd is not None
        return closed.value.rcvd.code

    assert asyncio.run(code()) == 1013


def test_a_server_that_stops_lets_its_viewers_go(tmp_path) -> None:
    echo = Echo()
    settings = patient_settings(tmp_path)
    app = create_app(settings)
    add_viewer_routes(app, lambda: echo.port)

    async def watch() -> int:
        async with await echo.listen():
            with ExitStack() as stack:
                running = stack.enter_context(serve(settings, app))
                viewer = await connect(running.port)
                await viewer.send(b"x")
                await viewer.recv()
                await asyncio.to_thread(stack.close)
            with pytest.raises(ConnectionClosed) as closed:
                await viewer.recv()
        assert closed.value.rcvd is not None
        return closed.value.rcvd.code

    assert asyncio.run(watch()) in (1001, 1012)
