"""What somebody with the read-only token can do by a page that shows the dashboard."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import is_dataclass
from enum import Enum
from itertools import chain
from types import SimpleNamespace
from typing import Any, Literal, get_args, get_origin, get_type_hints

import msgspec
import pytest
import websockets.asyncio.client

from benchmarks.headless_viewer import camera_fields
from slipgrasp.core.run.result import RunResult
from slipgrasp.server.tokens import Right, Tokens
from slipgrasp.web.app import create_dashboard_app
from slipgrasp.web.model.intents.hints import TryHints
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.page.intents_schema import KINDS, RIGHTS
from slipgrasp.web.reducers.export import ExportReducer
from slipgrasp.web.reducers.heavier import HeavierReducer
from slipgrasp.web.reducers.hints import HintsReducer
from slipgrasp.web.reducers.laws import LawsReducer
from slipgrasp.web.reducers.reducer import Reducer
from slipgrasp.web.reducers.runs import RunReducer
from slipgrasp.web.reducers.scenario import ScenarioReducer
from slipgrasp.web.reducers.study import StudyReducer
from tests.server.serving import RunningServer, patient_settings, serve
from tests.server.test_viewer_relay import PROTOCOL, Echo
from tests.web.reducing import view_of

pytestmark = pytest.mark.slow

TOKENS = Tokens("the-token-of-these-tests")
LOOKS = [kind for kind, right in RIGHTS.items() if right is Right.READ]
WORKS = [kind for kind, right in RIGHTS.items() if right is Right.EVERYTHING]


def sample(hint: Any) -> Any:
    """A value that a field of an intent may have."""
    if is_dataclass(hint):
        return {name: sample(part) for name, part in get_type_hints(hint).items()}
    if get_origin(hint) is Literal:
        return get_args(hint)[0]
    if get_args(hint):
        return sample(get_args(hint)[0])
    return next(iter(hint)).value if issubclass(hint, Enum) else hint()


def gesture(kind: type[Intent]) -> dict[str, Any]:
    """What a page posts for an intent of a kind."""
    return {"kind": KINDS[kind], **sample(kind)}


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


@pytest.mark.parametrize("kind", LOOKS)
def test_who_may_look_can_play_and_open_runs(server, taken, kind) -> None:
    address, reached = taken
    with server.client() as client:
        shown = {"Authorization": f"Bearer {TOKENS.read_only}"}
        assert client.post(address, json=[gesture(kind)], headers=shown).status_code == 202
    assert [type(intent) for intent in reached] == [kind]


@pytest.mark.parametrize("kind", WORKS)
def test_who_may_look_changes_and_computes_nothing(server, taken, kind) -> None:
    address, reached = taken
    with server.client() as client:
        shown = {"Authorization": f"Bearer {TOKENS.read_only}"}
        gestures = [gesture(LOOKS[0]), gesture(kind)]
        answer = client.post(address, json=gestures, headers=shown)
        assert answer.status_code == 403 and "read-only" in answer.json()["detail"]
        assert reached == []
        assert client.post(address, json=gestures[1:]).status_code == 202
    assert [type(intent) for intent in reached] == [kind, TryHints]


@pytest.fixture(scope="module")
def working() -> Iterator[list[Reducer]]:
    """What has something simulated, stored or drawn for good, without services to do it."""
    none: Any = SimpleNamespace(preparation=None)
    reducers = [
        ExportReducer(none, none, none, none),
        HeavierReducer(none, none),
        HintsReducer(none, none),
        LawsReducer(none, none),
        RunReducer(none, none, none, simulates_first=False),
        StudyReducer(none, none, none),
    ]
    yield reducers
    for worker in chain.from_iterable(reducer.workers for reducer in reducers):
        worker.close()


@pytest.mark.parametrize("kind", LOOKS)
def test_no_intent_that_only_looks_computes_or_changes_a_scenario(
    kind: type[Intent], working: list[Reducer], case_2: RunResult
) -> None:
    intent, view = kind(**sample(kind)), view_of(case_2)
    assert [reducer for reducer in working if reducer.reduce(intent, view) is not view] == []
    assert ScenarioReducer().reduce(intent, view).draft is view.draft


def test_what_who_may_look_does_to_widgets_is_ignored(server, monkeypatch) -> None:
    echo = Echo()
    monkeypatch.setattr(type(server.app.state.dashboard), "port", property(lambda _: echo.port))
    camera = msgspec.msgpack.encode({"type": "ViewerCameraMessage", **camera_fields()})
    update = {"type": "GuiUpdateMessage", "uuid": "x", "updates": {"value": 1}}
    ignored = [
        msgspec.msgpack.encode(update),
        msgspec.msgpack.encode({"type": "CommandTriggerMessage", "uuid": "y"}),
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
