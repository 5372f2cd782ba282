"""Comparisons and tables through the REST interface, against a real server."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from slipgrasp.recordings.compare.comparison import compare
from slipgrasp.recordings.file.reader import read_recording

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def slipperier(server):
    changed = {"scenario": "paper-case-1", "set": {"fingers.0.friction": 0.2525}}
    with server.client() as client:
        return client.post("/runs", json=changed).json()


def both(sample_run, slipperier):
    return {"a": sample_run["id"], "b": slipperier["id"]}


def test_two_runs_are_compared_as_on_the_command_line(client, sample_run, slipperier):
    answer = client.get("/diff", params=both(sample_run, slipperier))

    a, b = (read_recording(path) for path in _paths(sample_run, slipperier))
    expected = json.loads(json.dumps(compare(a, b).to_mapping()))
    assert answer.json() == expected
    assert list(answer.json()["first_divergence"]) == list(expected["first_divergence"])
    assert answer.json()["scenario"] == [{"key": "fingers.0.friction", "a": 0.25, "b": 0.2525}]


def _paths(*runs):
    return [Path(run["recording"]) for run in runs]


def test_the_tolerance_decides(client, sample_run, slipperier):
    params = both(sample_run, slipperier)

    assert client.get("/diff", params={**params, "tolerance": 1e-9}).json()["equal"] is False
    assert client.get("/diff", params={**params, "tolerance": 1e3}).json()["equal"] is True


@pytest.mark.parametrize("path", ["/diff", "/diff/figure"])
@pytest.mark.parametrize("run_id", ["abcdefghijkl", "..", ""])
def test_an_unknown_run_is_not_found(client, sample_run, path, run_id):
    answer = client.get(path, params={"a": sample_run["id"], "b": run_id})

    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
    assert "there is no recording" in answer.json()["detail"]


@pytest.mark.parametrize(
    ("wrong", "field"),
    [
        ({"tolerance": "nan"}, "tolerance"),
        ({"b": "x" * 101}, "b"),
        ({"tolerence": "1"}, "tolerence"),
    ],
)
def test_a_wrong_question_is_told_by_its_field(client, sample_run, wrong, field):
    run_id = sample_run["id"]

    answer = client.get("/diff", params={"a": run_id, "b": run_id, **wrong})

    assert answer.status_code == 422
    assert [error["field"] for error in answer.json()["errors"]] == [field]


def test_the_difference_is_drawn(client, sample_run, slipperier):
    params = {**both(sample_run, slipperier), "format": "svg"}
    answer = client.get("/diff/figure", params=params)
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "image/svg+xml"
    assert answer.content.startswith(b"<?xml")


def test_a_planar_against_a_spatial_hand_is_refused_in_a_sentence(client):
    short = {"simulation.duration": 0.02}
    asked = [{"scenario": name, "set": short} for name in ("three-fingers", "spatial-box")]
    a, b = (client.post("/runs", json=body).json()["id"] for body in asked)
    for path in ("/diff", "/diff/figure"):
        answer = client.get(path, params={"a": a, "b": b})
        assert answer.status_code == 422
        assert "a planar and a spatial hand cannot be compared" in answer.json()["detail"]
