"""What somebody with the read-only token can do by a page that shows the dashboard."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import fields

import msgspec
import pytest
import websockets.asyncio.client

from slipgrasp.server.tokens import Tokens
from slipgrasp.web.app import create_dashboard_app
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.page.intents_schema import CHANGING, KINDS
from tests.server.serving import RunningServer, patient_settings, serve
from tests.server.test_viewer_relay import PROTOCOL, Echo

pytestmark = pytest.mark.slow

TOKENS = Tokens("the-token-of-these-tests")
CHANGES = [{"kind": KINDS[kind]} for kind in CHANGING if not fields(kind)]
LOOKS = [
    {"kind": "toggle-play"},
    {"kind": "seek", "time": 0.5},
    {"kind": "open-recording", "run_id": "abcdefghijkl"},
    {"kind": "list-recordings", "page": 0},
]


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    settings = patient_settings(tmp_path_factory.mktemp("shown"), token=TOKENS.full)
    with serve(settings, create_dashboard_app(settings)) as running:
        yield running


@pytest.fixture
def taken(server: RunningServer) -> Iterator[tuple[str, list[Intent]]]:
    """A session's address for what its page posts, and what reached it."""
    reached: list[Intent] = []
    directory = server.app.state.dashboard.directory
    key = directory.enter(reached.append)
    yield f"{server.url}/dashboard/sessions/{key}/intents", reached
    directory.remove(key)


@pytest.mark.parametrize("gesture", LOOKS, ids=lambda gesture: gesture["kind"])
def test_who_may_look_can_play_and_open_runs(server, taken, gesture) -> None:
    address, reached = taken
    with server.client() as client:
        shown = {"Authorization": f"Bearer {TOKENS.read_only}"}
        assert client.post(address, json=[gesture], headers=shown).status_code == 202
    assert len(reached) == 1


@pytest.mark.parametrize("gesture", CHANGES, ids=lambda gesture: gesture["kind"])
def test_who_may_look_cannot_change_a_scenario_or_a_study(server, taken, gesture) -> None:
    address, reached = taken
    with server.client() as client:
        shown = {"Authorization": f"Bearer {TOKENS.read_only}"}
        answer = client.post(address, json=[LOOKS[0], gesture], headers=shown)
        assert answer.status_code == 403 and "look only" in answer.json()["detail"]
        assert reached == []
        assert client.post(address, json=[gesture]).status_code == 202
    assert len(reached) == 1


def test_what_who_may_look_does_to_widgets_is_ignored(server, monkeypatch) -> None:
    echo = Echo()
    monkeypatch.setattr(type(server.app.state.dashboard), "port", property(lambda _: echo.port))
    camera = msgspec.msgpack.encode({"type": "ViewerCameraMessage", "fov": 1.0})
    ignored = [
        msgspec.msgpack.encode({"type": "GuiUpdateMessage", "uuid": "x", "updates": {}}),
        msgspec.msgpack.encode(
            {"type": "FileTransferStartUpload", "transfer_uuid": "y", "size_bytes": 1}
        ),
    ]

    async def answer(token: str) -> object:
        address = f"ws://127.0.0.1:{server.port}/"
        async with (
            await echo.listen(),
            websockets.asyncio.client.connect(
                address,
                subprotocols=[PROTOCOL],
                additional_headers={"Authorization": f"Bearer {token}"},
                proxy=None,
            ) as viewer,
        ):
            for frame in (*ignored, camera):
                await viewer.send(frame)
            return await viewer.recv()

    assert asyncio.run(answer(TOKENS.read_only)) == camera
    assert asyncio.run(answer(TOKENS.full)) == ignored[0]
