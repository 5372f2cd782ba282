"""Behind a reverse proxy that shows the server at a path, whether it takes that away or not."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass

import pytest
import viser

from slipgrasp.server.exceptions import SettingsError
from slipgrasp.server.settings import Settings
from slipgrasp.server.tokens import Right, Tokens
from slipgrasp.web.app import create_dashboard_app
from tests.server.proxy import PathProxy, proxy_at
from tests.server.raw_http import Answer, get, post, upgrade
from tests.server.serving import RunningServer, patient_settings, serve

pytestmark = pytest.mark.slow

TOKENS = Tokens("the-token-of-these-tests")
BEARER = ("Authorization", f"Bearer {TOKENS.full}")
ROOT = "/lab/slipgrasp"
RUNS = f"{ROOT}/api/v1/runs"
BODY = json.dumps({"scenario": "paper-case-1", "set": {"simulation.duration": 0.01}}).encode()


@dataclass(frozen=True)
class Proxied:
    proxy: PathProxy
    server: RunningServer

    def get(self, path: str, *headers: tuple[str, str]) -> Answer:
        return get(self.proxy.port, path, [self.host, *headers])

    @property
    def host(self) -> tuple[str, str]:
        return "Host", f"127.0.0.1:{self.proxy.port}"

    @property
    def cookie(self) -> tuple[str, str]:
        return "Cookie", f"slipgrasp_{self.server.port}={TOKENS.cookie(Right.EVERYTHING)}"


@pytest.fixture(scope="module", params=[True, False], ids=["stripped", "kept"])
def proxied(request, tmp_path_factory) -> Iterator[Proxied]:
    folder = tmp_path_factory.mktemp("proxied")
    with proxy_at(ROOT, strips=request.param) as proxy:
        settings = patient_settings(
            folder, token=TOKENS.full, public_urls=(proxy.origin,), root_path=ROOT
        )
        with serve(settings, create_dashboard_app(settings)) as running:
            proxy.upstream_port = running.port
            yield Proxied(proxy, running)


def test_nobody_gets_in_through_a_proxy_without_a_token(proxied) -> None:
    for path in (f"{ROOT}/", RUNS, f"{ROOT}/dashboard/static/dashboard.js"):
        assert proxied.get(path).status == 401


def test_a_link_leads_to_the_page_and_its_cookie_is_for_the_path_alone(proxied) -> None:
    answer = proxied.get(f"{ROOT}/?token={TOKENS.full}&run=a")
    assert answer.status == 303 and answer.headers["location"] == f"{ROOT}/?run=a"
    given, *attributes = answer.headers["set-cookie"].split("; ")
    assert f"Path={ROOT}" in attributes and f"{given}" == proxied.cookie[1]
    page = proxied.get(f"{ROOT}/", proxied.cookie)
    assert page.status == 200
    assert f'src="{ROOT}/dashboard/static/dashboard.js"'.encode() in page.body


def test_the_page_finds_its_files_and_its_session(proxied) -> None:
    for path in ("dashboard/static/dashboard.js", "dashboard/sessions/x", "api/v1/docs"):
        assert proxied.get(f"{ROOT}/{path}", proxied.cookie).status == 200, path


@pytest.mark.parametrize("path", [ROOT, f"{ROOT}/"])
def test_the_websocket_opens_at_the_path_as_the_page_asks_for_it(proxied, path) -> None:
    headers = [proxied.host, proxied.cookie, ("Origin", proxied.proxy.origin)]
    protocol = f"viser-v{viser.__version__}"
    assert upgrade(proxied.proxy.port, path, headers, protocol).status == 101
    assert upgrade(proxied.proxy.port, path, headers[:1], protocol).status == 401


def test_every_address_that_an_answer_tells_leads_through_the_proxy(proxied) -> None:
    json_body = ("Content-Type", "application/json")
    headers = [proxied.host, BEARER, json_body]
    post(proxied.proxy.port, RUNS, headers, BODY)
    made = post(proxied.proxy.port, RUNS, headers, BODY)
    assert made.status == 201
    told = json.loads(made.body)["links"]
    assert made.headers["location"] == told["self"] and told["self"].startswith(f"{RUNS}/")
    page = json.loads(proxied.get(f"{RUNS}?limit=1", BEARER).body)["links"]["next"]
    presets = json.loads(proxied.get(f"{ROOT}/api/v1/presets", BEARER).body)["data"]
    for link in (*told.values(), page, presets[0]["links"]["self"]):
        assert proxied.get(link, BEARER).status == 200, link


def test_what_an_answer_tells_leads_to_the_server_itself_too(proxied) -> None:
    own = [("Host", f"127.0.0.1:{proxied.server.port}"), BEARER]
    presets = get(proxied.server.port, "/api/v1/presets", own)
    link = json.loads(presets.body)["data"][0]["links"]["self"]
    assert link.startswith(ROOT) and get(proxied.server.port, link, own).status == 200
    assert get(proxied.server.port, f"{ROOT}s/api/v1/health", own).status == 404


def test_the_path_without_its_slash_leads_to_the_page(proxied) -> None:
    own = [("Host", f"127.0.0.1:{proxied.server.port}"), BEARER]
    answer = get(proxied.server.port, f"{ROOT}?run=a", own)
    assert answer.status == 308 and answer.headers["location"] == f"{ROOT}/?run=a"


def test_the_description_and_the_refusals_name_the_path(proxied) -> None:
    document = json.loads(proxied.get(f"{ROOT}/api/v1/openapi.json", BEARER).body)
    assert document["servers"] == [{"url": ROOT}] and "/api/v1/runs" in document["paths"]
    missing = json.loads(proxied.get(f"{ROOT}/nothing", BEARER).body)["detail"]
    assert f"'{ROOT}/nothing'" in missing and missing.endswith(f"{ROOT}/api/v1/docs")


def test_a_server_at_a_path_knows_nobody_by_his_connection(tmp_path) -> None:
    assert Settings(data_directory=tmp_path, root_path=ROOT).needs_token


@pytest.mark.parametrize(
    "path", ["slipgrasp", "/", "/slipgrasp/", "//x", "/..", "/a b", "/api", "/dashboard/x", "/a?b"]
)
def test_what_is_no_path_is_refused(tmp_path, path) -> None:
    with pytest.raises(SettingsError, match="not a path of a server"):
        Settings(data_directory=tmp_path, root_path=path)
