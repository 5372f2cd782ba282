"""Host and Origin, on the port of the application and on viser's internal one."""

from __future__ import annotations

import asyncio
import json
import logging

import pytest
import viser
import websockets.asyncio.server

from slipgrasp.server.exceptions import SettingsError
from slipgrasp.server.http.access import (
    RELAY_TOKEN,
    RESOURCE_CONTENT_POLICY,
    check_access,
    guarded_websocket_listeners,
)
from slipgrasp.server.settings import Settings
from tests.server.raw_http import Answer, get, post, upgrade

PROTOCOL = f"viser-v{viser.__version__}"
BODY = json.dumps({"scenario": "paper-case-1", "set": {"simulation.duration": 0.01}}).encode()
JSON = ("Content-Type", "application/json")

OWN_HOSTS = ["127.0.0.1:{port}", "localhost:{port}", "[::1]:{port}", "LocalHost:{port}"]
FOREIGN_HOSTS = [
    "evil.example",
    "evil.example:{port}",
    "127.0.0.1",
    "localhost",
    "localhost:{other}",
    "127.0.0.1:{port}.evil.example",
    "localhost.evil.example:{port}",
    "evil.example@127.0.0.1:{port}",
    "127.0.0.2:{port}",
    "0.0.0.0:{port}",
    "[::]:{port}",
    "[::ffff:127.0.0.1]:{port}",
    "2130706433:{port}",
    "localhost.:{port}",
    "localhost:0{port}",
    "localhost:{port}/",
    "localhost:{port},evil.example",
    "",
]
OWN_ORIGINS = ["http://127.0.0.1:{port}", "http://localhost:{port}", "http://[::1]:{port}"]
FOREIGN_ORIGINS = [
    "http://evil.example",
    "http://evil.example:{port}",
    "null",
    "",
    "http://localhost",
    "http://localhost:{other}",
    "https://localhost:{port}",
    "http://localhost:{port}/",
    "http://localhost:{port}.evil.example",
    "http://localhost.evil.example:{port}",
    "http://evil.example/http://localhost:{port}",
    "http://localhost:{port} http://evil.example",
    "http://localhost:{port},http://evil.example",
    "http://user@localhost:{port}",
    "HTTP://localhost:{port}",
    "file://",
    "chrome-extension://abcdefghijklmnop",
    "localhost:{port}",
]


def filled(template: str, port: int) -> str:
    return template.format(port=port, other=port - 1)


def ask(kind: str, port: int, headers: list[tuple[str, str]]) -> Answer:
    if kind == "post":
        return post(port, "/api/v1/runs", [*headers, JSON], BODY)
    if kind == "websocket":
        return upgrade(port, "/", headers, PROTOCOL)
    return get(port, "/", headers)


PORTS = ["application", "viser"]


def shown(where: str) -> list[tuple[str, str]]:
    """What lets in at a port: on that of viser, which only the relay uses, its token."""
    return [("Authorization", f"Bearer {RELAY_TOKEN}")] if where == "viser" else []


def port_of(viewing, where: str) -> int:
    return viewing.server.port if where == "application" else viewing.viewer.get_port()


def kinds(where: str) -> list[str]:
    return ["get", "websocket", "post"] if where == "application" else ["get", "websocket"]


WELCOME = {"get": 200, "websocket": 101, "post": 201}


@pytest.mark.parametrize("where", PORTS)
@pytest.mark.parametrize("host", OWN_HOSTS)
def test_this_machine_is_welcome_under_its_own_names(viewing, where, host) -> None:
    port = port_of(viewing, where)
    for kind in kinds(where):
        answer = ask(kind, port, [("Host", filled(host, port)), *shown(where)])
        assert answer.status == WELCOME[kind], kind


@pytest.mark.parametrize("where", PORTS)
@pytest.mark.parametrize("origin", OWN_ORIGINS)
def test_its_own_page_is_welcome(viewing, where, origin) -> None:
    port = port_of(viewing, where)
    headers = [("Host", f"localhost:{port}"), ("Origin", filled(origin, port))]
    for kind in kinds(where):
        assert ask(kind, port, [*headers, *shown(where)]).status == WELCOME[kind], kind


@pytest.mark.parametrize("where", PORTS)
@pytest.mark.parametrize("host", FOREIGN_HOSTS)
def test_a_foreign_host_is_refused_before_anything_happens(viewing, where, host) -> None:
    port = port_of(viewing, where)
    for kind in kinds(where):
        assert ask(kind, port, [("Host", filled(host, port))]).status == 400, kind


@pytest.mark.parametrize("where", PORTS)
@pytest.mark.parametrize("origin", FOREIGN_ORIGINS)
def test_a_foreign_origin_is_refused_before_anything_happens(viewing, where, origin) -> None:
    port = port_of(viewing, where)
    headers = [("Host", f"127.0.0.1:{port}"), ("Origin", filled(origin, port))]
    for kind in kinds(where):
        assert ask(kind, port, headers).status == 403, kind


@pytest.mark.parametrize("where", PORTS)
def test_exactly_one_host_and_at_most_one_origin_are_taken(viewing, where) -> None:
    port = port_of(viewing, where)
    host, origin = ("Host", f"localhost:{port}"), ("Origin", f"http://localhost:{port}")
    for kind in kinds(where):
        assert ask(kind, port, []).status == 400, kind
        assert ask(kind, port, [host, host]).status == 400, kind
        assert ask(kind, port, [host, ("Host", "evil.example")]).status == 400, kind
        two_origins = [host, origin, ("Origin", "http://evil.example")]
        assert ask(kind, port, two_origins).status in (400, 403), kind


def test_viser_lets_in_the_relay_alone_not_the_programs_of_its_user(viewing) -> None:
    port = viewing.viewer.get_port()
    for kind in kinds("viser"):
        assert ask(kind, port, [("Host", f"localhost:{port}")]).status == 401, kind


def test_a_refusal_is_a_problem_that_says_the_way_out(viewing) -> None:
    port = viewing.server.port
    answer = get(port, "/api/v1/health", [("Host", "evil.example")])
    problem = json.loads(answer.body)
    assert answer.headers["content-type"] == "application/problem+json"
    assert problem["status"] == 400 and f"http://127.0.0.1:{port}" in problem["detail"]


def test_a_refused_request_creates_no_run(viewing) -> None:
    port = viewing.server.port
    with viewing.server.client() as client:
        before = client.get("/runs").json()["count"]
        ask("post", port, [("Host", f"localhost:{port}"), ("Origin", "null")])
        ask("post", port, [("Host", "evil.example")])
        assert client.get("/runs").json()["count"] == before


def test_the_default_port_may_be_left_out() -> None:
    assert check_access(["localhost"], ["http://localhost"], 80) is None
    assert check_access(["localhost:80"], [], 80) is None
    assert check_access(["localhost"], [], 8080) is not None


@pytest.mark.parametrize("path", ["/api/v1/health", "/api/v1/nothing", "/", "/api/v1/docs"])
def test_every_answer_carries_safe_headers(viewing, path) -> None:
    port = viewing.server.port
    headers = get(port, path, [("Host", f"localhost:{port}")]).headers
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cross-origin-resource-policy"] == "same-origin"
    assert "frame-ancestors 'self'" in headers["content-security-policy"]
    assert "access-control-allow-origin" not in headers


def test_what_is_no_page_may_run_nothing(client) -> None:
    policy = client.get("/health").headers["content-security-policy"]
    assert policy == RESOURCE_CONTENT_POLICY


def test_a_viewer_cannot_open_a_tunnel_from_the_internet(viewing, caplog) -> None:
    with caplog.at_level(logging.WARNING):
        assert viewing.viewer.request_share_url() is None
    assert "refused a viewer's request for a public share tunnel" in caplog.text
    assert viewing.viewer._share_tunnel is None


def test_viser_listens_on_loopback_only(viewing) -> None:
    assert viewing.viewer.get_host() == "127.0.0.1"


def test_a_server_that_opens_no_guarded_port_is_reported() -> None:
    with pytest.raises(RuntimeError, match="not guarded"), guarded_websocket_listeners():
        pass


def test_other_websocket_servers_are_left_alone_afterwards() -> None:
    serve = websockets.asyncio.server.serve
    with guarded_websocket_listeners():
        assert websockets.asyncio.server.serve is not serve
        asyncio.run(open_and_close())
    assert websockets.asyncio.server.serve is serve


async def open_and_close() -> None:
    async def ignore(connection: websockets.asyncio.server.ServerConnection) -> None:
        await connection.wait_closed()

    async with websockets.asyncio.server.serve(ignore, "127.0.0.1", 0):
        pass


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.1", "example.org", ""])
def test_a_server_for_the_network_is_not_started(tmp_path, host) -> None:
    with pytest.raises(SettingsError, match="nothing protects"):
        Settings(data_directory=tmp_path, host=host)


@pytest.mark.parametrize("port", [-1, 65536])
def test_a_port_that_does_not_exist_is_refused(tmp_path, port) -> None:
    with pytest.raises(SettingsError, match="port is"):
        Settings(data_directory=tmp_path, port=port)
