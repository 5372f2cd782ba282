"""PATCH and DELETE on a run, and what they depend on, against a real server."""

from __future__ import annotations

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


@pytest.mark.parametrize(
    ("change", "field", "said"),
    [
        ({"nmae": "x"}, "nmae", "did you mean 'name'"),
        ({"name": None}, "name", "string"),
        ({"name": "x" * 201}, "name", "200"),
        ({"tags": ["x" * 65]}, "tags.0", "64"),
        ([], "", "dictionary"),
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
        ("", 415),
    ],
)
def test_a_change_is_sent_as_json(client, run, kind, status) -> None:
    answer = client.patch(
        f"/runs/{run['id']}", content=b'{"name": "x"}', headers={"Content-Type": kind}
    )
    assert answer.status_code == status


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
