"""``slipgrasp serve`` beyond loopback: the link is printed, and everything else needs its token."""

from __future__ import annotations

import socket
import urllib.error
import urllib.request

import pytest

from tests.slipgrasp.test_serve_command import serving
from tests.waiting import PATIENCE

pytestmark = pytest.mark.slow


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def status_of(url: str, token: str = "") -> int:
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers)) as answer:
            return answer.status
    except urllib.error.HTTPError as refused:
        with refused:
            return refused.code


def test_the_first_line_is_the_link_and_the_tokens_lie_in_the_data_folder(slipgrasp):
    port = free_port()
    address = f"http://localhost:{port}"
    arguments = ("--port", port, "--host", "0.0.0.0", "--public-url", f"{address}/")
    with serving(slipgrasp, *arguments) as (process, line):
        token = (slipgrasp.data / "service.token").read_text().strip()
        looking = (slipgrasp.data / "service.read-only-token").read_text().strip()
        assert line == f"{address}/?token={token}\n"
        assert status_of(f"{address}/api/v1/runs") == 401
        assert status_of(f"{address}/api/v1/runs", token[:-1]) == 401
        assert status_of(f"{address}/api/v1/runs", token) == 200
        assert status_of(f"{address}/api/v1/runs", looking) == 200
        process.terminate()
        process.wait(timeout=PATIENCE)
        told = process.stderr.read()
    assert f"{address}/?token={looking}" in told and token not in told


def test_a_token_that_is_easily_guessed_is_refused_in_one_line(slipgrasp, monkeypatch):
    monkeypatch.setenv("SLIPGRASP_TOKEN", "guess")
    done = slipgrasp("serve", "--port", "0")
    assert done.returncode == 2 and done.stdout == ""
    assert "SLIPGRASP_TOKEN" in done.stderr and done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("--host", "0.0.0.0"), "--public-url"),
        (("--host", "192.0.2.1"), "cannot be used"),
        (("--public-url", "grasp.example"), "not the URL of a server"),
    ],
)
def test_an_address_that_cannot_be_served_is_refused_in_one_line(slipgrasp, arguments, reason):
    done = slipgrasp("serve", "--port", "0", *arguments)
    assert done.returncode == 2 and done.stdout == ""
    assert reason in done.stderr and done.stderr.count("\n") == 1


def test_on_loopback_the_url_is_printed_without_a_token_though_one_works(slipgrasp):
    with serving(slipgrasp, "--port", "0") as (_, line):
        token = (slipgrasp.data / "service.token").read_text().strip()
        assert "token" not in line
        assert status_of(f"{line.strip()}api/v1/health") == 200
        assert status_of(f"{line.strip()}api/v1/health", token) == 200
        assert status_of(f"{line.strip()}api/v1/health", "wrong") == 401


def test_a_token_of_the_environment_can_be_required_of_the_owner_too(slipgrasp, monkeypatch):
    token = "a-token-from-the-environment"
    monkeypatch.setenv("SLIPGRASP_TOKEN", token)
    with serving(slipgrasp, "--port", "0", "--require-token") as (_, line):
        url, _, shown = line.strip().partition("?token=")
        assert shown == token
        assert status_of(url) == status_of(f"{url}api/v1/health") == 401
        assert status_of(f"{url}api/v1/health", token) == 200
