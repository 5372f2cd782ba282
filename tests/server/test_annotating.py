"""PATCH and DELETE on a run, and what they depend on, against a real server."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx2
import pytest

from tests.server.serving import patient_settings, serve

SHORT = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.01}}
PROBLEM = "application/problem+json"


@pytest.fixture
def run(client: httpx2.Client) -> dict[str, Any]:
    made: dict[str, Any] = client.post("/runs", json=SHORT).json()
    return made


def test_name_notes_and_tags_are_changed_one_by_one(client, run) -> None:
    path = f"/runs/{run['id']}"
    assert (run["name"], run["notes"], run["tags"]) == ("", "", [])
    recorded = Path(run["recording"]).read_bytes()
    for change in ({"name": "first ✓"}, {"notes": "a\nb"}, {"tags": ["x", "y"]}, {"name": ""}, {}):
        run = {**run, **change}
        run["display_name"] = run["name"] or "paper-case-1 · duration 0.01 s"
        answer = client.patch(path, json=change)
        assert answer.status_code == 200 and answer.json() == run
        assert client.get(path).json() == run
    assert Path(run["recording"]).read_bytes() == recorded


def test_what_was_written_survives_a_restart(tmp_path) -> None:
    settings = patient_settings(tmp_path)
    with serve(settings) as running, running.client() as client:
        run = client.post("/runs", json=SHORT).json()
        changed = client.patch(f"/runs/{run['id']}", json={"name": "n", "tags": ["t"]}).json()
    with serve(settings) as running, running.client() as client:
        assert client.get(f"/runs/{run['id']}").json() == changed
        assert client.get("/runs", params={"tag": "t"}).json()["data"] == [changed]


@pytest.mark.parametrize(
    ("change", "field", "said"),
    [
        ({"nmae": "x"}, "nmae", "did you mean 'name'"),
        ({"title": "x"}, "title", "unknown field"),
        ({"name": None}, "name", "string"),
        ({"name": 1}, "name", "string"),
        ({"name": "x" * 201}, "name", "200"),
        ({"name": "a\nb"}, "name", "printable"),
        ({"notes": "x" * 10_001}, "notes", "10000"),
        ({"notes": "\x07"}, "notes", "control characters"),
        ({"tags": "x"}, "tags", "list"),
        ({"tags": [1]}, "tags.0", "string"),
        ({"tags": [""]}, "tags.0", "1 character"),
        ({"tags": ["x" * 65]}, "tags.0", "64"),
        ({"tags": ["a\tb"]}, "tags.0", "printable"),
        ({"tags": [str(i) for i in range(33)]}, "tags", "32"),
        ([], "", "dictionary"),
        ("name", "", "dictionary"),
    ],
)
def test_a_wrong_change_is_refused_by_field_and_nothing_changes(
    client, run, change, field, said
) -> None:
    answer = client.patch(f"/runs/{run['id']}", json=change)
    assert answer.status_code == 422 and answer.headers["content-type"] == PROBLEM
    (error,) = answer.json()["errors"]
    assert error["field"] == field and said in error["message"]
    assert client.get(f"/runs/{run['id']}").json() == run


@pytest.mark.parametrize(
    ("kind", "status"),
    [
        ("application/json", 200),
        ("application/merge-patch+json; charset=utf-8", 200),
        ("text/plain", 415),
        ("application/x-www-form-urlencoded", 415),
        ("", 415),
    ],
)
def test_a_change_is_sent_as_json(client, run, kind, status) -> None:
    answer = client.patch(
        f"/runs/{run['id']}", content=b'{"name": "x"}', headers={"Content-Type": kind}
    )
    assert answer.status_code == status


def test_a_change_that_is_no_json_is_unreadable(client, run) -> None:
    for content in (b"", b"{", b"\xff", b"[" * 100_000):
        answer = client.patch(
            f"/runs/{run['id']}", content=content, headers={"Content-Type": "application/json"}
        )
        assert answer.status_code == 400


def test_a_change_for_another_version_is_refused(client, run) -> None:
    path = f"/runs/{run['id']}"
    first = client.get(path).headers["etag"]
    answer = client.patch(path, json={"name": "1"}, headers={"If-Match": first})
    second = answer.headers["etag"]
    assert answer.status_code == 200 and second != first
    assert client.get(path).headers["etag"] == second
    for outdated in (first, "", "x", f"W/{second}", '"x"'):
        answer = client.patch(path, json={"name": "2"}, headers={"If-Match": outdated})
        assert answer.status_code == answer.json()["status"] == 412
    assert client.get(path).json()["name"] == "1"
    for present in (second, f'"x", {second}'):
        answer = client.patch(path, json={"name": "1"}, headers={"If-Match": present})
        assert answer.status_code == 200
    assert client.patch(path, json={"name": "3"}, headers={"If-Match": "*"}).status_code == 200


def test_of_changes_at_once_for_one_version_one_is_made(server, client, run) -> None:
    tag = client.get(f"/runs/{run['id']}").headers["etag"]

    def change(name: str) -> int:
        with server.client() as other:
            headers = {"If-Match": tag}
            return other.patch(
                f"/runs/{run['id']}", json={"name": name}, headers=headers
            ).status_code

    with ThreadPoolExecutor(2) as pool:
        assert sorted(pool.map(change, ["a", "b"])) == [200, 412]


def test_a_run_that_the_client_has_is_not_sent_again(client, run) -> None:
    path = f"/runs/{run['id']}"
    tag = client.get(path).headers["etag"]
    answer = client.get(path, headers={"If-None-Match": tag})
    assert (answer.status_code, answer.content, answer.headers["etag"]) == (304, b"", tag)
    client.patch(path, json={"notes": "new"})
    assert client.get(path, headers={"If-None-Match": tag}).json()["notes"] == "new"


def test_a_deleted_run_is_gone(client, run) -> None:
    path = f"/runs/{run['id']}"
    answer = client.delete(path)
    assert (answer.status_code, answer.content) == (204, b"")
    assert not Path(run["recording"]).exists()
    assert not Path(run["recording"]).with_suffix(".json").exists()
    for again in (client.delete(path), client.get(path), client.patch(path, json={"name": "x"})):
        assert again.status_code == again.json()["status"] == 404
    assert run["id"] not in [listed["id"] for listed in client.get("/runs").json()["data"]]


def test_a_foreign_page_can_neither_change_nor_delete_nor_send(client, run) -> None:
    headers = {"Origin": "http://evil.example"}
    path = f"/runs/{run['id']}"
    recorded = Path(run["recording"]).read_bytes()
    assert client.patch(path, json={"name": "x"}, headers=headers).status_code == 403
    assert client.delete(path, headers=headers).status_code == 403
    assert client.post("/recordings", content=recorded, headers=headers).status_code == 403
    assert client.get(path).json() == run


def test_a_damaged_recording_is_listed_with_its_reason_and_can_be_deleted(tmp_path) -> None:
    damaged = tmp_path / "abcdefghijkl.mcap"
    damaged.write_bytes(b"\x89MCAP0\r\n" + bytes(100))
    with serve(patient_settings(tmp_path)) as running, running.client() as client:
        (run,) = client.get("/runs", params={"outcome": "failed"}).json()["data"]
        assert run["reason"]["code"] == "damaged_recording" and "damaged" in run["title"]
        assert client.patch("/runs/abcdefghijkl", json={"name": "x"}).json()["name"] == "x"
        assert client.delete("/runs/abcdefghijkl").status_code == 204
        assert client.get("/runs").json()["count"] == 0 and not damaged.exists()


def test_a_link_in_the_data_folder_is_neither_changed_nor_deleted(tmp_path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("secret")
    folder = tmp_path / "data"
    folder.mkdir()
    link = folder / "abcdefghijkl.mcap"
    link.symlink_to(secret)
    with serve(patient_settings(folder)) as running, running.client() as client:
        assert client.delete("/runs/abcdefghijkl").status_code == 404
        assert client.patch("/runs/abcdefghijkl", json={"name": "x"}).status_code == 404
    assert link.is_symlink() and secret.read_text() == "secret"


def test_a_damaged_sidecar_is_written_anew_by_a_change(client, run) -> None:
    sidecar = Path(run["recording"]).with_suffix(".json")
    sidecar.write_text('{"name": 1, "tags": ["kept"]')
    changed = client.patch(f"/runs/{run['id']}", json={"name": "x"}).json()
    assert changed["metrics"] == run["metrics"] and changed["name"] == "x"
    assert json.loads(sidecar.read_text())["name"] == "x"


def test_the_description_shows_examples_of_changes_and_searches(client) -> None:
    document = client.get("/openapi.json").json()
    paths = document["paths"]
    patch = paths["/api/v1/runs/{run_id}"]["patch"]
    assert patch["requestBody"]["content"]["application/json"]["schema"] == {
        "$ref": "#/components/schemas/RunUpdate"
    }
    schema = document["components"]["schemas"]["RunUpdate"]
    assert schema["properties"].keys() == {"name", "notes", "tags"} == schema["example"].keys()
    assert {"200", "400", "404", "412", "415", "422"} <= patch["responses"].keys()
    assert {"204", "404"} <= paths["/api/v1/runs/{run_id}"]["delete"]["responses"].keys()
    asked = {p["name"]: p for p in paths["/api/v1/runs"]["get"]["parameters"]}
    assert asked.keys() >= {"preset", "controller", "outcome", "tag", "created_from", "metric"}
    assert all(parameter["description"] for parameter in asked.values())
    assert asked["metric"]["schema"]["examples"] or asked["metric"]["examples"]
    post = paths["/api/v1/recordings"]["post"]
    assert post["requestBody"]["content"].keys() >= {"application/octet-stream"}
    assert {"201", "400", "408", "413", "415", "422", "507"} <= post["responses"].keys()
