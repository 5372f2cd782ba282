"""GET /runs with filters, against a real server."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import httpx2
import pytest

from slipgrasp.core.scenario.custom_laws import CustomLaw, LawIdentity, forget, remember
from tests.server.serving import patient_settings, serve

LOST = {"controller.position_gain": 1e6}


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx2.Client]:
    settings = patient_settings(tmp_path_factory.mktemp("library"))
    with serve(settings) as running, running.client() as client:
        yield client


@pytest.fixture(scope="module")
def runs(library: httpx2.Client) -> list[dict[str, Any]]:
    """Three runs that differ in everything, oldest first."""
    bodies = [
        {"scenario": "paper-case-1", "set": {"simulation.duration": 0.5}},
        {"scenario": "paper-case-2", "set": {"simulation.duration": 0.3}},
        {"scenario": "paper-case-1", "set": {**LOST, "title": "lost grip"}},
    ]
    made = [library.post("/runs", json=body).json() for body in bodies]
    library.patch(f"/runs/{made[0]['id']}", json={"name": "Straße", "tags": ["a", "b"]})
    library.patch(f"/runs/{made[1]['id']}", json={"notes": "slippery", "tags": ["b"]})
    return [library.get(f"/runs/{run['id']}").json() for run in made]


@pytest.mark.parametrize(
    ("query", "expected"),
    [
        ("preset=", [2]),
        ("controller=theorem-4&preset=paper-case-2&outcome=completed", [1]),
        ("tag=b&tag=a&text=strasse", [0]),
        ("metric=end_time%3E0.2&metric=held=false&sort=created&limit=1", [0]),
        ("created_from=2000-01-01&created_to=2999-01-01", [2, 1, 0]),
        ("created_to=2000-01-01T00:00:00Z", []),
    ],
)
def test_runs_are_found_by_every_field(library, runs, query, expected) -> None:
    answer = library.get(f"/runs?{query}")
    assert answer.status_code == 200, answer.text
    listed = answer.json()
    assert listed["data"] == [runs[i] for i in expected]
    assert listed["count"] >= len(expected) and listed["unread"] == 0


def test_a_law_that_became_known_later_can_be_searched_for(library, runs) -> None:
    assert library.get("/runs?controller=late").status_code == 422
    identity = LawIdentity(name="late", version="1", digest="0" * 64)
    remember(CustomLaw(identity=identity, summary="It came after the first request."))
    answer = library.get("/runs?controller=late")
    forget("late")
    assert (answer.status_code, answer.json()["data"]) == (200, [])


@pytest.mark.parametrize(
    ("query", "field", "near"),
    [
        ("tga=x", "tga", "did you mean 'tag'"),
        ("preset=paper-case-3", "preset", "did you mean 'paper-case-"),
        ("controller=theorem-5", "controller", "did you mean 'theorem-"),
        ("outcome=complete", "outcome", "did you mean 'completed'"),
        ("metric=slip_pth_0<1", "metric", "did you mean 'slip_path_0'"),
        ("created_from=yesterday", "created_from", "ISO 8601"),
        ("text=" + "x" * 201, "text", "200"),
        ("&".join(["metric=end_time<1"] * 21), "metric", "20"),
        ("limit=2001", "limit", "1000"),
    ],
)
def test_a_wrong_search_is_refused_by_field_with_the_way_out(library, query, field, near) -> None:
    answer = library.get(f"/runs?{query}")
    assert answer.status_code == 422 and answer.headers["content-type"].startswith("application/pr")
    (error,) = answer.json()["errors"]
    assert error["field"] == field and near in error["message"]


def test_all_wrong_fields_of_a_search_are_named(library) -> None:
    query = "preset=a&controller=b&outcome=c&sort=d&metric=e&created_from=f&created_to=g&hue=h"
    errors = library.get(f"/runs?{query}").json()["errors"]
    fields = ["preset", "controller", "outcome", "sort", "metric", "created_from", "created_to"]
    assert sorted(error["field"] for error in errors) == sorted([*fields, "hue"])


@pytest.mark.parametrize("text", ["%00", "%ff", "%F0%9F%98%80", "'", "%25", "%22;--", "%ed%a0%80"])
@pytest.mark.parametrize("field", ["text", "tag", "preset", "sort", "metric", "created_from"])
def test_no_text_of_a_search_is_answered_with_a_server_error(library, field, text) -> None:
    assert library.get(f"/runs?{field}={text}").status_code in (200, 422)
