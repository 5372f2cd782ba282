"""Who gets in: every route, websocket and port, asked by everybody who may come along."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import pytest
import viser

from slipgrasp.server.tokens import Right, Tokens
from slipgrasp.web.app import create_dashboard_app
from tests.server.raw_http import KEY, Answer, exchange
from tests.server.serving import RunningServer, patient_settings, serve
from tests.server.visitors import another_account, ask_as, needs_another_account

pytestmark = pytest.mark.slow

TOKENS = Tokens("the-token-of-these-tests")
FOREIGN = Tokens("the-token-of-another-server")
LOOKING = ("GET", "HEAD")

Ask = Callable[[int, list[bytes]], list[Answer]]
Request = tuple[str, str]
"""Method and path; an upgrade to a websocket is called by that name."""


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    settings = patient_settings(tmp_path_factory.mktemp("guarded"), token=TOKENS.full)
    with serve(settings, create_dashboard_app(settings)) as running:
        yield running


@pytest.fixture(scope="module")
def distrustful(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    """A server that is reached from elsewhere too, so that nobody is known by his connection."""
    folder = tmp_path_factory.mktemp("distrustful")
    settings = patient_settings(
        folder, token=TOKENS.full, public_urls=("https://grasp.example", "http://lab7:8020")
    )
    with serve(settings, create_dashboard_app(settings)) as running:
        yield running


@pytest.fixture(scope="module")
def stranger() -> Iterator[Ask]:
    with another_account() as account:
        yield partial(ask_as, account)


def all_requests(server: RunningServer) -> list[Request]:
    found = sorted(leaves(server.app.router.routes))
    assert {path for _, path in found} >= set(server.app.openapi()["paths"])
    filled = [(method, re.sub(r"\{.*?\}", "nothing-here", path)) for method, path in found]
    return [*filled, ("WEBSOCKET", "/"), ("GET", "/no/such/path"), ("PUT", "/")]


def leaves(routes: list[Any]) -> Iterator[Request]:
    for route in routes:
        if hasattr(route, "effective_candidates"):
            yield from leaves(route.effective_candidates())
        else:
            yield from ((method, route.path) for method in getattr(route, "methods", None) or ())


def written(port: int, request: Request, *headers: str) -> bytes:
    method, path = request
    lines = [f"{method} {path} HTTP/1.1", f"Host: 127.0.0.1:{port}", *headers]
    if method == "WEBSOCKET":
        lines[0] = f"GET {path} HTTP/1.1"
        lines += ["Upgrade: websocket", "Sec-WebSocket-Version: 13", f"Sec-WebSocket-Key: {KEY}"]
        lines += ["Connection: Upgrade", f"Sec-WebSocket-Protocol: viser-v{viser.__version__}"]
    else:
        lines += ["Connection: close", "Content-Length: 0"]
    return "\r\n".join([*lines, "", ""]).encode("latin-1")


def ask_as_the_owner(port: int, requests: list[bytes]) -> list[Answer]:
    return [exchange(port, request) for request in requests]


def answers(server: RunningServer, ask: Ask, *headers: str) -> dict[Request, Answer]:
    asked = all_requests(server)
    lines = [written(server.port, request, *headers) for request in asked]
    return dict(zip(asked, ask(server.port, lines), strict=True))


def bearer(token: str) -> str:
    return f"Authorization: Bearer {token}"


def cookie(server: RunningServer, tokens: Tokens, right: Right) -> str:
    return f"Cookie: other=1; slipgrasp_{server.port}={tokens.cookie(right)}"


def let_in(found: dict[Request, Answer]) -> list[Request]:
    return [request for request, answer in found.items() if answer.status not in (401, 403)]


def assert_everything_is_open(found: dict[Request, Answer]) -> None:
    assert let_in(found) == list(found)
    assert all(answer.status < 500 for answer in found.values())


def assert_nothing_is_open(found: dict[Request, Answer]) -> None:
    for request, answer in found.items():
        assert answer.status == 401, request
        assert answer.headers["content-type"] == "application/problem+json"
        assert answer.headers["www-authenticate"].startswith("Bearer")
        assert answer.headers["referrer-policy"] == "no-referrer"
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert "content-security-policy" in answer.headers
        assert request[0] == "HEAD" or b'"status":401' in answer.body


def assert_only_looking_is_open(found: dict[Request, Answer]) -> None:
    for (method, path), answer in found.items():
        own_session = path.startswith("/dashboard/sessions/")
        if method in (*LOOKING, "WEBSOCKET") or own_session:
            assert answer.status not in (401, 403), (method, path)
        else:
            assert answer.status == 403, (method, path)


def test_the_owner_of_this_machine_needs_nothing(guarded) -> None:
    assert_everything_is_open(answers(guarded, ask_as_the_owner))
    foreign = cookie(guarded, FOREIGN, Right.EVERYTHING)
    assert_everything_is_open(answers(guarded, ask_as_the_owner, foreign))


def test_a_wrong_token_is_refused_whoever_shows_it(guarded) -> None:
    for shown in (FOREIGN.full, TOKENS.full.upper(), TOKENS.full[:-1], "", f"{TOKENS.full} x"):
        assert_nothing_is_open(answers(guarded, ask_as_the_owner, bearer(shown)))
    both = (bearer(TOKENS.full), bearer(TOKENS.full))
    assert_nothing_is_open(answers(guarded, ask_as_the_owner, *both))


@needs_another_account()
def test_another_user_of_the_machine_gets_nothing(guarded, stranger) -> None:
    assert_nothing_is_open(answers(guarded, stranger))
    assert_nothing_is_open(answers(guarded, stranger, bearer(FOREIGN.full)))
    foreign = cookie(guarded, FOREIGN, Right.EVERYTHING)
    assert_nothing_is_open(answers(guarded, stranger, foreign))
    assert_nothing_is_open(answers(guarded, stranger, f"Cookie: slipgrasp_1={1}"))


@needs_another_account()
def test_another_user_gets_nothing_of_the_viewer_port(guarded, stranger) -> None:
    port = guarded.app.state.dashboard.port
    requests = [("GET", "/"), ("WEBSOCKET", "/"), ("GET", "/nothing")]
    for headers in ([], [bearer(TOKENS.full)], [cookie(guarded, TOKENS, Right.EVERYTHING)]):
        lines = [written(port, request, *headers) for request in requests]
        found = stranger(port, lines)
        assert_nothing_is_open(dict(zip(requests, found, strict=True)))


@needs_another_account()
def test_another_user_with_the_token_may_do_everything(guarded, stranger) -> None:
    assert_everything_is_open(answers(guarded, stranger, bearer(TOKENS.full)))
    own = cookie(guarded, TOKENS, Right.EVERYTHING)
    assert_everything_is_open(answers(guarded, stranger, own))


@needs_another_account()
def test_another_user_with_the_read_only_token_may_look(guarded, stranger) -> None:
    assert_only_looking_is_open(answers(guarded, stranger, bearer(TOKENS.read_only)))
    own = cookie(guarded, TOKENS, Right.READ)
    assert_only_looking_is_open(answers(guarded, stranger, own))


def test_where_others_reach_the_server_its_owner_needs_the_token_too(distrustful) -> None:
    assert_nothing_is_open(answers(distrustful, ask_as_the_owner))
    assert_everything_is_open(answers(distrustful, ask_as_the_owner, bearer(TOKENS.full)))
    assert_only_looking_is_open(answers(distrustful, ask_as_the_owner, bearer(TOKENS.read_only)))


def test_a_public_address_is_a_name_and_an_origin_of_its_own(distrustful) -> None:
    for url in distrustful.settings.public_urls:
        host = f"Host: {url.partition('//')[2]}"
        head = ["POST /api/v1/runs HTTP/1.1", host, bearer(TOKENS.full), "Content-Length: 0"]
        for origin, status in ((url, 415), ("https://grasp.example.evil", 403)):
            lines = [*head, f"Origin: {origin}", "Connection: close", "", ""]
            answer = exchange(distrustful.port, "\r\n".join(lines).encode())
            assert answer.status in (status, 400 if status == 415 else 403), (url, origin)


def test_whom_a_proxy_speaks_for_is_not_known_by_its_connection(guarded) -> None:
    for header in ("X-Forwarded-For: 127.0.0.1", "Forwarded: for=127.0.0.1", "Via: 1.1 x"):
        assert_nothing_is_open(answers(guarded, ask_as_the_owner, header))


def test_a_connection_stays_known_while_it_lives(guarded) -> None:
    with guarded.client() as client:
        assert [client.get("/health").status_code for _ in range(3)] == [200] * 3
