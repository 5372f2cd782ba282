"""The page's own script, and how what it posts reaches a session."""

from __future__ import annotations

import gzip
import json
import queue
from collections.abc import Iterator
from dataclasses import dataclass

import httpx2
import pytest

from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.playback import Seek, TogglePlay
from slipgrasp.web.page.routes import head_html
from tests.server.raw_http import get, post
from tests.server.serving import RunningServer
from tests.waiting import PATIENCE


@dataclass
class Entered:
    """A session without a viewer."""

    port: int
    key: str
    taken: queue.SimpleQueue[Intent]

    def post(self, body: object, key: str | None = None) -> httpx2.Response:
        with httpx2.Client(trust_env=False, verify=False) as client:
            return client.post(
                f"http://127.0.0.1:{self.port}/dashboard/sessions/{key or self.key}/intents",
                content=body if isinstance(body, bytes) else json.dumps(body).encode(),
                headers={"Content-Type": "application/json"},
            )


@pytest.fixture
def entered(dashboard: RunningServer) -> Iterator[Entered]:
    taken: queue.SimpleQueue[Intent] = queue.SimpleQueue()
    directory = dashboard.app.state.dashboard.directory
    key = directory.enter(taken.put)
    yield Entered(dashboard.port, key, taken)
    directory.remove(key)


def state_of(entered: Entered, key: str) -> dict[str, object]:
    answer = get(entered.port, f"/dashboard/sessions/{key}", [host(entered.port)])
    state: dict[str, object] = json.loads(answer.body)
    return state


def host(port: int) -> tuple[str, str]:
    return ("Host", f"127.0.0.1:{port}")


def test_our_style_and_script_stand_first_in_the_head_of_viser_s_page(
    dashboard: RunningServer,
) -> None:
    page = get(dashboard.port, "/", [host(dashboard.port)])
    assert page.body.partition(b"<head>")[2].startswith(head_html().encode())
    assert page.body.count(b"</html>") == 1
    assert page.body.count(b"<title>") == page.body.count(b'rel="icon"') == 1
    assert "'self'" in page.headers["content-security-policy"]


@pytest.mark.parametrize("path", ["/", "/dashboard/static/dashboard.js"])
def test_a_page_that_is_loaded_again_sends_none_of_its_files_again(
    dashboard: RunningServer, path: str
) -> None:
    first = get(dashboard.port, path, [host(dashboard.port)])
    seen = ("If-None-Match", first.headers["etag"])
    again = get(dashboard.port, path, [host(dashboard.port), seen])
    assert (again.status, again.body, again.headers["etag"]) == (304, b"", first.headers["etag"])
    takes = ("Accept-Encoding", "gzip, br")
    small = get(dashboard.port, path, [host(dashboard.port), takes])
    assert small.headers["content-encoding"] == "gzip" and len(small.body) < len(first.body)
    assert gzip.decompress(small.body) == first.body


@pytest.mark.parametrize("name", ["keys.py", "..%2Fapp.py", "nothing.js", "%2e%2e/app.py"])
def test_nothing_else_is_served(dashboard: RunningServer, name: str) -> None:
    answer = get(dashboard.port, f"/dashboard/static/{name}", [host(dashboard.port)])
    assert answer.status == 404


def test_what_a_page_posts_reaches_its_session_in_order(entered: Entered) -> None:
    answer = entered.post([{"kind": "toggle-play"}, {"kind": "seek", "time": 2}])
    assert answer.status_code == 202
    assert [entered.taken.get(timeout=PATIENCE) for _ in range(2)] == [TogglePlay(), Seek(2.0)]


@pytest.mark.parametrize(
    ("body", "status"),
    [
        ([{"kind": "fly"}], 422),
        ([{"kind": "open-link", "run": "x" * 999, "time": ""}], 422),
        ([{"kind": "toggle-play"}] * 21, 422),
        ({"kind": "toggle-play"}, 422),
        (b'[{"kind": "seek", "time": NaN}]', 422),
        (b'[{"kind": "seek", "time": 1e999}]', 422),
        (b"[", 400),
        (b"[" + b'"x",' * 600 + b"1]", 422),
    ],
)
def test_what_no_page_posts_is_refused_in_words_and_reaches_nobody(
    entered: Entered, body: object, status: int
) -> None:
    answer = entered.post(body)
    assert answer.status_code == status
    assert answer.json()["detail"]
    assert entered.taken.empty()


def test_nobody_can_post_to_a_session_without_its_key(entered: Entered) -> None:
    assert entered.post([{"kind": "toggle-play"}], key="guessed").status_code == 404
    assert entered.taken.empty()


def test_a_foreign_page_cannot_post_even_with_the_key(entered: Entered) -> None:
    path = f"/dashboard/sessions/{entered.key}/intents"
    headers = [host(entered.port), ("Content-Type", "application/json")]
    foreign = [*headers, ("Origin", "http://evil.example")]
    body = b'[{"kind": "toggle-play"}]'
    assert post(entered.port, path, foreign, body).status == 403
    assert post(entered.port, path, headers, body).status == 202


def test_a_page_can_ask_whether_its_session_lives(entered: Entered) -> None:
    state = state_of(entered, entered.key)
    assert (state["alive"], state["full"]) == (True, False)
    other = state_of(entered, "none")
    assert (other["alive"], other["server"]) == (False, state["server"])
