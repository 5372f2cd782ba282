"""Comparisons and tables through the REST interface, against a real server."""

from __future__ import annotations

import io
import json
import shutil
from pathlib import Path

import numpy as np
import pyarrow.parquet
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


def test_a_run_and_itself_have_no_difference(client, sample_run):
    run_id = sample_run["id"]

    answer = client.get("/diff", params={"a": run_id, "b": run_id})

    assert answer.status_code == 200
    assert answer.json() == {
        "equal": True,
        "scenario": [],
        "phase_changes": [],
        "first_divergence": {},
        "signals": {},
        "metrics": {},
        "cause": None,
        "integration_error": None,
        "contradictions": [],
    }


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


def test_runs_that_ended_in_different_ways_are_compared(client, sample_run):
    lost = {"scenario": "paper-case-1", "set": {"controller.position_gain": 1e6}}
    ended_early = client.post("/runs", json=lost).json()
    assert ended_early["outcome"] != sample_run["outcome"]

    answer = client.get("/diff", params=both(sample_run, ended_early))

    assert answer.status_code == 200, answer.text
    outcomes = {"a": sample_run["outcome"], "b": ended_early["outcome"]}
    assert answer.json()["metrics"]["outcome"] == outcomes


@pytest.mark.parametrize("path", ["/diff", "/diff/figure"])
@pytest.mark.parametrize("run_id", ["abcdefghijkl", "..", "%2e%2e%2fetc", "\0", ""])
def test_an_unknown_run_is_not_found(client, sample_run, path, run_id):
    answer = client.get(path, params={"a": sample_run["id"], "b": run_id})

    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
    assert "there is no recording" in answer.json()["detail"]


@pytest.mark.parametrize(
    ("wrong", "field"),
    [
        ({"tolerance": "nan"}, "tolerance"),
        ({"tolerance": "-1"}, "tolerance"),
        ({"tolerance": "inf"}, "tolerance"),
        ({"tolerance": "1e999"}, "tolerance"),
        ({"b": "x" * 101}, "b"),
        ({"tolerence": "1"}, "tolerence"),
    ],
)
def test_a_wrong_question_is_told_by_its_field(client, sample_run, wrong, field):
    run_id = sample_run["id"]

    answer = client.get("/diff", params={"a": run_id, "b": run_id, **wrong})

    assert answer.status_code == 422
    assert [error["field"] for error in answer.json()["errors"]] == [field]


def test_both_runs_must_be_named(client, sample_run):
    answer = client.get("/diff", params={"a": sample_run["id"]})

    assert answer.status_code == 422
    assert [error["field"] for error in answer.json()["errors"]] == ["b"]


def test_runs_of_different_hands_cannot_be_compared(client, sample_run):
    scenario = json.loads(client.get("/presets/paper-case-1").text)
    mapping = scenario.get("scenario", scenario)
    mapping["fingers"].append({**mapping["fingers"][0], "contact_offset": 0.05})
    mapping["controller"]["grasp_force"] = "none"
    mapping["simulation"]["duration"] = 0.05
    three = client.post("/runs", json={"scenario": mapping})
    assert three.status_code == 201, three.text

    answer = client.get("/diff", params={"a": sample_run["id"], "b": three.json()["id"]})

    assert answer.status_code == 422
    assert "2 and 3 fingers" in answer.json()["detail"]


@pytest.mark.parametrize("path", ["/diff", "/diff/figure"])
def test_a_planar_against_a_spatial_hand_is_refused_in_a_sentence(client, path):
    short = {"simulation.duration": 0.02}
    planar, spatial = (
        client.post("/runs", json={"scenario": name, "set": short}).json()["id"]
        for name in ("three-fingers", "spatial-box")
    )

    for a, b in ((planar, spatial), (spatial, planar)):
        answer = client.get(path, params={"a": a, "b": b})
        assert answer.status_code == 422
        assert answer.headers["content-type"] == "application/problem+json"
        assert "a planar and a spatial hand cannot be compared" in answer.json()["detail"]


def test_a_damaged_recording_is_told_as_such(client, server, sample_run):
    (path,) = _paths(sample_run)
    damaged = path.with_name("damaged00000.mcap")
    shutil.copy(path, damaged)
    with damaged.open("r+b") as stream:
        stream.truncate(damaged.stat().st_size // 2)
    try:
        answer = client.get("/diff", params={"a": sample_run["id"], "b": "damaged00000"})
    finally:
        damaged.unlink()

    assert answer.status_code == 422
    assert "damaged" in answer.json()["detail"]


@pytest.mark.parametrize(
    ("chosen", "media_type", "start"),
    [("svg", "image/svg+xml", b"<?xml"), ("png", "image/png", b"\x89PNG")],
)
def test_the_difference_is_drawn(client, sample_run, slipperier, chosen, media_type, start):
    params = {**both(sample_run, slipperier), "format": chosen}

    answer = client.get("/diff/figure", params=params)

    assert answer.status_code == 200
    assert answer.headers["content-type"] == media_type
    assert answer.content.startswith(start)


def test_an_unknown_format_of_the_picture_is_refused(client, sample_run, slipperier):
    params = {**both(sample_run, slipperier), "format": "bmp"}

    answer = client.get("/diff/figure", params=params)

    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "format"


def test_the_columns_can_be_had_as_parquet_and_npz(client, sample_run):
    run_id = sample_run["id"]
    (path,) = _paths(sample_run)
    slip = read_recording(path).trace.slip[:, 0].tobytes()

    parquet = client.get(f"/runs/{run_id}/signals.parquet")
    npz = client.get(f"/runs/{run_id}/signals.npz")

    table = pyarrow.parquet.read_table(io.BytesIO(parquet.content))
    assert table["slip_0"].to_numpy().tobytes() == slip
    with np.load(io.BytesIO(npz.content), allow_pickle=False) as arrays:
        assert arrays["slip_0"].tobytes() == slip
    assert f"{run_id}.parquet" in parquet.headers["content-disposition"]
    assert f"{run_id}.npz" in npz.headers["content-disposition"]


@pytest.mark.parametrize("ending", ["parquet", "npz"])
def test_tables_of_unknown_runs_are_not_found(client, ending):
    assert client.get(f"/runs/abcdefghijkl/signals.{ending}").status_code == 404
