from __future__ import annotations

import json
import socket
from typing import Any

import httpx2
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from slipgrasp.server.exceptions import InvalidRequestError, UnreadableBodyError
from slipgrasp.server.http.json_body import (
    MAX_DEPTH,
    MAX_NAME_LENGTH,
    MAX_NAMES,
    MAX_VALUES,
    read_json,
)
from tests.server.raw_http import exchange, post
from tests.waiting import PATIENCE

pytestmark = pytest.mark.slow

PROBLEM = "application/problem+json"


def refused(client: httpx2.Client, content: bytes | str, status: int = 422) -> list[dict[str, Any]]:
    """Posts a body, expects that it is refused, that nothing is saved and that the server lives."""
    before = client.get("/runs").json()["count"]
    answer = client.post("/runs", content=content, headers={"Content-Type": "application/json"})
    problem = answer.json()
    assert answer.status_code == problem["status"] == status, answer.text
    assert answer.headers["content-type"] == PROBLEM
    assert problem.keys() == {"type", "title", "status", "detail", "errors"}
    assert all(e.keys() == {"field", "value", "limit", "message"} for e in problem["errors"])
    assert problem["errors"] and all(e["message"] for e in problem["errors"])
    assert client.get("/runs").json()["count"] == before
    errors: list[dict[str, Any]] = problem["errors"]
    return errors


def with_value(key: str, literal: str) -> str:
    return f'{{"scenario": "paper-case-1", "set": {{"{key}": {literal}}}}}'


@pytest.mark.parametrize(
    "literal",
    ["1e300", "NaN", "9" * 5000, "true", "null"],
)
def test_a_mass_that_is_no_sensible_number_is_refused_by_name(client, literal) -> None:
    (error,) = refused(client, with_value("object.mass", literal))
    assert error["field"] == "object.mass"
    assert error["limit"] == "0.001 … 1000 kg"


@pytest.mark.parametrize(
    ("key", "literal"),
    [
        ("fingers.1.link_masses.1", "NaN"),
        ("title", '"\\u0000"'),
        ("title", '"\\ud800"'),
        ("title", json.dumps("x" * 10_000)),
    ],
)
def test_a_value_out_of_bounds_is_refused_by_name(client, key, literal) -> None:
    (error,) = refused(client, with_value(key, literal))
    assert error["field"].endswith(key)
    assert error["limit"]


def test_a_value_that_is_repeated_is_short_and_printable(client) -> None:
    (error,) = refused(client, with_value("controller.kind", json.dumps("<b>\u202e\n" * 50)))
    assert error["value"].startswith("<b>??") and len(error["value"]) <= 80


JSON_TYPE = {"Content-Type": "application/json"}


def test_an_unknown_key_is_refused_with_the_nearest_name(client) -> None:
    (error,) = refused(client, with_value("fingers.7.friction", "1"))
    assert error["field"] == "fingers.7.friction"
    assert "did you mean 'fingers.1.friction'" in error["message"]


@pytest.mark.parametrize(
    "key", ["", ".", "object.", "fingers.\u00b2.friction", "fingers.1e3", "\u202e"]
)
def test_a_key_that_is_none_is_refused(client, key) -> None:
    refused(client, json.dumps({"scenario": "paper-case-1", "set": {key: 1}}))


def test_fingers_that_cannot_reach_are_refused_with_distance_and_reach(client) -> None:
    (error,) = refused(client, with_value("fingers.0.link_lengths.1", "0.2"))
    assert error["field"] == "fingers.0.base"
    assert error["value"] == pytest.approx(1.414, abs=1e-3) and error["limit"] == "0.8 … 1.2 m"


def test_several_wrong_fields_are_all_listed(client) -> None:
    values = {"object.mass": -1, "object.inertia": "x", "fingers.1.friction": False}
    errors = refused(client, json.dumps({"scenario": "paper-case-1", "set": values}))
    assert {error["field"] for error in errors} == set(values)


def test_an_unknown_preset_is_refused_and_a_file_of_the_machine_is_none(client, tmp_path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text("title = 'x'")
    for name in ("paper-case-3", "../paper-case-1", str(file), "/etc/passwd", ""):
        (error,) = refused(client, json.dumps({"scenario": name}))
        assert error["field"] == "scenario" and "paper-case-1" in error["limit"]


def test_a_file_of_the_machine_is_no_table_of_a_motion(client, tmp_path) -> None:
    file = tmp_path / "moves.csv"
    file.write_text("0, 1.466, 0.366, 0")
    scenario = client.get("/presets/paper-case-1").json()["scenario"]
    scenario["trajectory"] |= {"kind": "table", "table": str(file)}
    for body in (json.dumps({"scenario": scenario}), with_value("trajectory.table", f'"{file}"')):
        (error,) = refused(client, body)
        assert error["field"] == "trajectory.table"
        assert "give the rows themselves" in error["message"]


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ("[]", ""),
        ("{}", "scenario"),
        ('{"scenario": 1}', "scenario"),
        ('{"scenario": "paper-case-1", "set": null}', "set"),
        ('{"scenario": "paper-case-1", "sett": {}}', "sett"),
        ('{"scenario": {}}', "fingers"),
        ('{"scenario": {"fingers": 1}}', "fingers"),
    ],
)
def test_a_body_of_the_wrong_shape_is_refused_by_field(client, body, field) -> None:
    assert field in {error["field"] for error in refused(client, body)}


def test_an_unknown_field_is_refused_with_the_nearest_name(client) -> None:
    (error,) = refused(client, '{"scenario": "paper-case-1", "sett": {}}')
    assert "did you mean 'set'" in error["message"]


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b'{"scenario": "paper-case-1"}}',
        b'\xef\xbb\xbf{"scenario": "paper-case-1"}',
        b'{"scenario": "paper\xff-case-1"}',
        b'{"scenario": "paper\xed\xa0\x80"}',
        '{"scenario": "paper-case-1"}'.encode("utf-16"),
        b"[" * 100_000 + b"]" * 100_000,
    ],
)
def test_what_is_no_json_is_unreadable(client, body) -> None:
    refused(client, body, status=400)


@pytest.mark.parametrize("depth", [MAX_DEPTH + 1, 900])
def test_a_body_nested_too_deep_is_refused(client, depth) -> None:
    errors = refused(client, with_value("object.mass", "[" * depth + "]" * depth))
    assert f"{MAX_DEPTH} levels" in errors[0]["message"]


def test_a_name_given_twice_is_refused(client) -> None:
    (error,) = refused(client, '{"scenario": "paper-case-1", "scenario": "paper-case-2"}')
    assert error["field"] == "scenario" and "twice" in error["message"]
    refused(client, '{"scenario": "paper-case-1", "set": {"object.mass": 1, "object.mass": 2}}')


def test_more_names_than_there_are_parameters_are_refused_at_once(client) -> None:
    values = {f"object.mass{i}": 1 for i in range(MAX_NAMES + 1)}
    (error,) = refused(client, json.dumps({"scenario": "paper-case-1", "set": values}))
    assert error["field"] == "set"


@pytest.mark.parametrize("name", ["a" * (MAX_NAME_LENGTH + 1), "fingers." + "9" * 5000])
def test_a_name_longer_than_any_key_is_refused(client, name) -> None:
    (error,) = refused(client, json.dumps({"scenario": "paper-case-1", "set": {name: 1}}))
    assert len(error["field"]) <= 100


@pytest.mark.parametrize("item", ["{}", "1", '{"a": 1, "b": 2}'])
def test_more_values_than_a_scenario_can_have_are_refused_at_once(client, item) -> None:
    items = ",".join([item] * (MAX_VALUES + 1))
    (error,) = refused(client, f'{{"scenario": {{"fingers": [{items}]}}}}')
    assert error["limit"] == f"{MAX_VALUES} values"


@pytest.mark.parametrize("kind", ["text/plain", "application/x-www-form-urlencoded", "", "json"])
def test_a_body_of_another_type_is_refused(client, kind) -> None:
    headers = {"Content-Type": kind}
    answer = client.post("/runs", content='{"scenario": "paper-case-1"}', headers=headers)
    assert answer.status_code == 415 and answer.headers["content-type"] == PROBLEM


def test_json_with_a_charset_is_json(client) -> None:
    headers = {"Content-Type": "Application/JSON; charset=utf-8"}
    body = with_value("simulation.duration", "0.01")
    assert client.post("/runs", content=body, headers=headers).status_code == 201


def test_a_body_that_declares_to_be_too_large_is_not_read(server) -> None:
    head = (
        f"POST /api/v1/runs HTTP/1.1\r\nHost: localhost:{server.port}\r\n"
        "Content-Type: application/json\r\nContent-Length: 1000001\r\n\r\n"
    )
    answer = exchange(server.port, head.encode())
    assert answer.status == 413 and answer.headers["content-type"] == PROBLEM


@pytest.mark.parametrize("path", ["/api/v1/runs", "/api/v1/health", "/api/v1/nothing"])
def test_a_body_in_chunks_is_cut_off_at_the_limit(server, path) -> None:
    head = (
        f"POST {path} HTTP/1.1\r\nHost: localhost:{server.port}\r\n"
        "Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
    )
    chunk = b"10000\r\n" + b" " * 0x10000 + b"\r\n"
    answer = exchange(server.port, head.encode(), *[chunk] * 40, b"0\r\n\r\n")
    assert answer.status == {"/api/v1/runs": 413, "/api/v1/health": 405}.get(path, 404)


def test_a_broken_chunk_of_a_refused_request_is_no_error_of_ours(server, caplog) -> None:
    head = (
        "POST /api/v1/runs HTTP/1.1\r\nHost: evil.example\r\n"
        "Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
    )
    with socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE) as connection:
        connection.sendall(head.encode())
        with connection.makefile("rb") as answer:
            assert answer.readline().startswith(b"HTTP/1.1 400 ")
            connection.sendall(b"no length\r\n")
            assert b"HTTP/1.1" not in answer.read()
    assert not [record for record in caplog.records if record.exc_info]


def test_a_body_just_within_the_limit_is_read(server, client) -> None:
    body = b'{"scenario": "paper-case-1", "set": {"simulation.duration": 0.01}}'
    padded = body + b" " * (1_000_000 - len(body))
    assert client.post("/runs", content=padded, headers=JSON_TYPE).status_code == 201
    host = ("Host", f"localhost:{server.port}")
    larger = post(server.port, "/api/v1/runs", [host, *JSON_TYPE.items()], padded + b" ")
    assert larger.status == 413


@pytest.mark.parametrize(
    ("method", "path", "allowed"),
    [
        ("DELETE", "/runs", "GET, POST"),
        ("PUT", "/runs/abcdefghijkl", "DELETE, GET, PATCH"),
        ("POST", "/runs/abcdefghijkl/recording", "GET, HEAD"),
        ("NONSENSE", "/runs", "GET, POST"),
    ],
)
def test_another_method_is_refused_with_those_there_are(client, method, path, allowed) -> None:
    answer = client.request(method, path)
    assert answer.status_code == 405 and answer.headers["allow"] == allowed
    assert answer.headers["content-type"] == PROBLEM


@pytest.mark.parametrize(
    "path", ["/", "/nothing", "/runs/", "/runs/x/y", "/presets/nothing", "/docs/x"]
)
def test_an_unknown_path_is_a_problem(client, path) -> None:
    answer = client.get(path)
    assert answer.status_code == answer.json()["status"] == 404
    assert answer.headers["content-type"] == PROBLEM


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ("limit=0", "limit"),
        ("limit=1000000000", "limit"),
        ("offset=" + "9" * 30, "offset"),
        ("ofset=1", "ofset"),
        ("%00=1", "?"),
    ],
)
def test_a_page_that_cannot_be_is_refused(client, query, field) -> None:
    answer = client.get(f"/runs?{query}")
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert error["field"] == field and error["message"]


IDS = [
    "..",
    "%2e%2e%2f%2e%2e%2fetc%2fpasswd",
    "abcdefghijkl%00",
    "abcdefghijkl%0a",
    "abcdefghijkl.mcap",
    "ABCDEFGHIJKL",
    "x" * 5000,
    ".",
    "%D0%B0bcdefghijkl",
    "%ff%fe",
    "a%2fb",
    "abcdefghijkl",
]


@pytest.mark.parametrize("run_id", IDS)
@pytest.mark.parametrize(
    ("method", "part"),
    [
        ("GET", ""),
        ("GET", "/signals.csv"),
        ("HEAD", "/recording"),
        ("PATCH", ""),
        ("DELETE", ""),
    ],
)
def test_an_id_that_is_none_is_not_found(server, run_id, method, part) -> None:
    outside = sorted(path.name for path in server.data_directory.parent.iterdir())
    body = b'{"name": "x"}' if method == "PATCH" else b""
    request = (
        f"{method} /api/v1/runs/{run_id}{part} HTTP/1.1\r\nHost: localhost:{server.port}\r\n"
        f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n"
    )
    if method == "HEAD":
        assert raw_status(server.port, request.encode()) in (404, 422)
        return
    answer = exchange(server.port, request.encode() + body)
    assert answer.status in ((404, 405, 422) if run_id == "." else (404, 422))
    assert answer.headers["content-type"] == PROBLEM
    assert b"root:" not in answer.body
    assert sorted(path.name for path in server.data_directory.parent.iterdir()) == outside


def raw_status(port: int, request: bytes) -> int:
    with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as connection:
        connection.sendall(request)
        return int(connection.recv(65536).split()[1])


JSON_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=20,
)
BODIES = (
    st.binary(max_size=200)
    | JSON_VALUES.map(lambda value: json.dumps(value).encode())
    | st.builds(
        lambda scenario, values: json.dumps({"scenario": scenario, "set": values}).encode(),
        st.sampled_from(["paper-case-1", "x"]) | JSON_VALUES,
        st.dictionaries(st.sampled_from(["object", "fingers.0", "title", "a"]), JSON_VALUES),
    )
)


@given(body=BODIES)
@settings(
    max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_no_body_is_ever_answered_with_a_server_error(client, body) -> None:
    answer = client.post("/runs", content=body, headers=JSON_TYPE)
    assert answer.status_code in (201, 400, 422), answer.text
    assert answer.json()


@given(value=JSON_VALUES)
def test_json_that_is_read_is_what_was_written(value) -> None:
    body = json.dumps(value).encode()
    try:
        read = read_json(body)
    except InvalidRequestError:
        return
    assert json.dumps(read) == json.dumps(value)


@given(body=st.binary())
def test_bytes_are_read_or_refused_and_nothing_else(body) -> None:
    try:
        read_json(body)
    except (UnreadableBodyError, InvalidRequestError) as error:
        assert str(error)


def test_a_file_of_the_machine_is_no_scenario(client, tmp_path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text("title = 'x'")
    for name in (str(file), "/etc/passwd", "core/scenario/presets/paper-case-1.toml"):
        (error,) = refused(client, json.dumps({"scenario": name}))
        assert error["field"] == "scenario"
