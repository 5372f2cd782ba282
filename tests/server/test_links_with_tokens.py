"""A link with a token becomes a cookie, and nothing tells of the token afterwards."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator

import pytest

from slipgrasp.server.exceptions import SettingsError
from slipgrasp.server.peers import Connection
from slipgrasp.server.settings import Settings
from slipgrasp.server.tokens import READ_ONLY_TOKEN_FILE, TOKEN_FILE, Right, Tokens
from tests.server.raw_http import Answer, exchange, get, upgrade
from tests.server.serving import RunningServer, patient_settings, serve

TOKENS = Tokens("the-token-of-these-tests")
DOCS = "/api/v1/docs"


@pytest.fixture(scope="module")
def server(tmp_path_factory) -> Iterator[RunningServer]:
    folder = tmp_path_factory.mktemp("linked")
    settings = patient_settings(folder, token=TOKENS.full, public_urls=("http://lab7:8020",))
    with serve(settings) as running:
        yield running


def ask(server: RunningServer, path: str, **headers: str) -> Answer:
    pairs = [(name.replace("_", "-"), value) for name, value in headers.items()]
    return get(server.port, path, [("Host", f"127.0.0.1:{server.port}"), *pairs])


@pytest.mark.parametrize("right", [Right.EVERYTHING, Right.READ])
def test_a_link_gives_a_cookie_and_leads_on_without_the_token(server, right) -> None:
    token = TOKENS.full if right is Right.EVERYTHING else TOKENS.read_only
    answer = ask(server, f"{DOCS}?token={token}&run=a%26b")
    assert answer.status == 303 and answer.headers["location"] == f"{DOCS}?run=a%26b"
    assert answer.headers["cache-control"] == "no-store"
    given, _, attributes = answer.headers["set-cookie"].partition(";")
    assert given == f"slipgrasp_{server.port}={TOKENS.cookie(right)}"
    assert {"HttpOnly", "SameSite=strict", "Path=/"} <= set(attributes.strip().split("; "))
    assert token not in given
    assert ask(server, DOCS, Cookie=given).status == 200


def test_a_link_on_another_page_goes_on_from_a_page_of_ours(server) -> None:
    foreign = {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate"}
    path = f"{DOCS}?token={TOKENS.full}"
    answer = ask(server, path, **foreign, Sec_Fetch_Dest="document")
    assert answer.status == 200 and "set-cookie" in answer.headers
    assert f"url={DOCS}".encode() in answer.body and TOKENS.full.encode() not in answer.body


def test_a_link_followed_in_a_browser_that_tells_nothing_is_taken_for_one_on_another_page(
    server,
) -> None:
    answer = ask(server, f"{DOCS}?token={TOKENS.full}", Accept="text/html,*/*;q=0.8")
    assert answer.status == 200 and f"url={DOCS}".encode() in answer.body


def test_a_websocket_is_opened_by_no_token_in_its_address(server) -> None:
    host = ("Host", f"127.0.0.1:{server.port}")
    assert upgrade(server.port, f"/?token={TOKENS.full}", [host]).status == 401


@pytest.mark.parametrize("query", ["token=", "token=wrong", "token={t}&token={t}", "token={t}x"])
def test_a_wrong_link_gives_nothing(server, query) -> None:
    answer = ask(server, f"{DOCS}?{query.format(t=TOKENS.full)}")
    assert answer.status == 401 and "set-cookie" not in answer.headers


def test_a_token_in_the_address_opens_pages_only(server) -> None:
    assert ask(server, f"/api/v1/runs?token={TOKENS.full}").status == 401


@pytest.mark.parametrize("site", ["cross-site", "same-site", "something-new"])
def test_another_page_gets_nothing_but_the_opening_of_ours(server, site) -> None:
    asked = {"Sec_Fetch_Site": site, "Authorization": f"Bearer {TOKENS.full}"}
    opening = {**asked, "Sec_Fetch_Mode": "navigate", "Sec_Fetch_Dest": "document"}
    assert ask(server, DOCS, **opening).status == 200
    assert ask(server, "/api/v1/runs", **opening).status == 403
    assert ask(server, DOCS, **asked).status == 403
    framing = {**opening, "Sec_Fetch_Dest": "iframe"}
    assert ask(server, DOCS, **framing).status == 403


@pytest.mark.parametrize("site", ["same-origin", "none"])
def test_our_own_pages_and_people_are_let_pass(server, site) -> None:
    headers = {"Sec_Fetch_Site": site, "Authorization": f"Bearer {TOKENS.full}"}
    assert ask(server, "/api/v1/runs", **headers).status == 200


def test_a_cookie_of_https_is_never_sent_without(tmp_path) -> None:
    settings = patient_settings(tmp_path, token=TOKENS.full, public_urls=("https://grasp.example",))
    with serve(settings) as running:
        answer = ask(running, f"{DOCS}?token={TOKENS.full}")
    assert "Secure" in answer.headers["set-cookie"]


def test_no_line_of_the_log_has_the_token(server, caplog, capfd) -> None:
    with caplog.at_level("DEBUG", logger="uvicorn"), caplog.at_level("INFO"):
        ask(server, f"{DOCS}?token={TOKENS.full}")
        ask(server, f"{DOCS}?token={TOKENS.full}x")
        ask(server, "/api/v1/runs", Authorization=f"Bearer {TOKENS.full}x")
    assert TOKENS.full not in caplog.text + "".join(capfd.readouterr())
    assert TOKENS.full not in repr(server.settings) + repr(TOKENS)


def test_the_tokens_lie_in_files_of_the_owner_alone(server) -> None:
    folder = server.data_directory
    for name, token in ((TOKEN_FILE, TOKENS.full), (READ_ONLY_TOKEN_FILE, TOKENS.read_only)):
        path = folder / name
        assert path.read_text() == f"{token}\n"
        assert stat.S_IMODE(path.stat().st_mode) == 0o600


@pytest.mark.parametrize("token", ["", "short", "with spaces in it 1", "x" * 201, "ünïcödé" * 4])
def test_a_token_that_is_easily_guessed_or_cannot_be_sent_is_refused(token) -> None:
    with pytest.raises(SettingsError, match="SLIPGRASP_TOKEN"):
        Tokens(token)


def test_tokens_made_at_the_start_are_not_guessed() -> None:
    made = {Tokens.random().full for _ in range(100)}
    assert len(made) == 100 and min(map(len, made)) >= 43


@pytest.mark.parametrize("host", ["0.0.0.0", "::"])
def test_a_server_that_listens_everywhere_has_to_know_its_name(tmp_path, host) -> None:
    with pytest.raises(SettingsError, match="--public-url"):
        Settings(data_directory=tmp_path, host=host, token=TOKENS.full)


@pytest.mark.parametrize(
    "url", ["grasp.example", "ftp://x", "http://x/path", "http://u@x", "http://X", "http://x y"]
)
def test_what_is_no_public_address_is_refused(tmp_path, url) -> None:
    with pytest.raises(SettingsError, match="not the URL of a server"):
        Settings(data_directory=tmp_path, token=TOKENS.full, public_urls=(url,))


@pytest.mark.skipif(os.name != "posix", reason="there are no such permissions")
def test_a_data_folder_is_closed_to_others_when_it_is_served(tmp_path) -> None:
    folder = tmp_path / "runs"
    folder.mkdir(mode=0o755)
    (folder / "abc.mcap").touch()
    with serve(patient_settings(folder)):
        assert stat.S_IMODE(folder.stat().st_mode) == 0o700


@pytest.mark.skipif(os.name != "posix", reason="there are no such permissions")
def test_a_folder_that_serves_others_too_stays_as_it_is(tmp_path) -> None:
    shared, own = tmp_path / "shared", tmp_path / "project"
    shared.mkdir()
    shared.chmod(0o1777)
    own.mkdir()
    own.chmod(0o755)
    (own / "thesis.tex").touch()
    for folder, mode in ((shared, 0o1777), (own, 0o755)):
        with serve(patient_settings(folder)):
            assert stat.S_IMODE(folder.stat().st_mode) == mode


def test_nobody_holds_a_connection_that_there_is_not() -> None:
    for address in ("127.0.0.1", "::1", "::ffff:127.0.0.1", "fe80::1%lo"):
        assert not Connection((address, 9), (address, 9)).is_own
    assert not Connection(("127.0.0.1", 9), ("::1", 9)).is_own


def test_what_is_not_http_is_refused_with_safe_headers(server) -> None:
    answer = exchange(server.port, b"GET nonsense\x00\r\n\r\n")
    assert answer.status == 400
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["x-content-type-options"] == "nosniff"
