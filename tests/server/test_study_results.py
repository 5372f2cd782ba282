"""What came out of a study, through the REST interface."""

from __future__ import annotations

import io
import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict

import numpy as np
import pytest

from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.state_hash import state_hash
from slipgrasp.recordings.study.results import read_results
from slipgrasp.server.budget import SMALL_BYTES, Need
from tests.server.serving import patient_settings, serve
from tests.server.studying import LONG, QUICK, create, finished, until

pytestmark = pytest.mark.slow

FILES = ["results.csv", "results.json", "results.parquet", "map.svg", "map.png", "recording"]


@pytest.mark.parametrize("file", [*FILES[:4], "summary", "comparison"])
def test_beyond_the_memory_for_reading_a_table_map_or_summary_is_refused_for_a_while(
    studying, studies, finished_study, file, monkeypatch
):
    memory = studying.app.state.run_service.memory
    studying.app.state.file_cache.close()
    monkeypatch.setattr("slipgrasp.server.budget.ROW_COST", SMALL_BYTES)
    monkeypatch.setattr(memory, "_patience", 0.05)
    with memory.reserve(Need(memory.limit, "others")):
        answer = studies.get(path_of(finished_study, file))
    assert answer.status_code == 503 and int(answer.headers["Retry-After"]) > 0
    assert "memory" in answer.json()["detail"]
    assert studies.get(path_of(finished_study, file)).status_code == 200


def path_of(study, rest):
    return f"/studies/{study['id']}/{rest}"


@pytest.fixture(scope="module")
def rows(studying, finished_study):
    with studying.client() as client:
        return client.get(path_of(finished_study, "results")).json()["data"]


def test_columns_are_described_with_their_units(studies, finished_study, rows):
    page = studies.get(path_of(finished_study, "results"), params={"limit": 1}).json()

    columns = {column["name"]: column for column in page["columns"]}
    assert list(columns) == list(rows[0])
    assert columns["object.mass"]["unit"] == "kg" and columns["object.mass"]["role"] == "varied"
    assert columns["torque_effort"]["role"] == "metric"


def test_rows_are_sorted_and_chosen_as_asked(studies, finished_study, rows):
    params = {"sort": "-torque_effort", "held": False, "outcome": "completed"}
    page = studies.get(path_of(finished_study, "results"), params=params).json()
    chosen = [row for row in rows if not row["held"] and row["outcome"] == "completed"]
    assert page["data"] == sorted(chosen, key=lambda row: -row["torque_effort"])
    assert page["count"] == len(chosen) > 0
    none = studies.get(path_of(finished_study, "results"), params={"held": True}).json()
    assert none["count"] == sum(bool(row["held"]) for row in rows)


def test_pages_follow_each_other_by_their_links(studies, finished_study, rows):
    page = studies.get(path_of(finished_study, "results"), params={"limit": 15}).json()
    collected = page["data"]
    while "next" in page["links"]:
        page = studies.get(page["links"]["next"].removeprefix("/api/v1")).json()
        collected += page["data"]

    assert collected == rows
    assert page["count"] == page["finished"] == 40
    assert page["links"].keys() == {"prev"}


@pytest.mark.parametrize(
    ("params", "field"),
    [
        ({"sort": "slip_path"}, "sort"),
        ({"outcome": "won"}, "outcome"),
        ({"limit": 0}, "limit"),
        ({"colour": "red"}, "colour"),
    ],
)
def test_a_wrong_question_names_its_field(studies, finished_study, params, field):
    answer = studies.get(path_of(finished_study, "results"), params=params)

    assert answer.status_code == 422
    assert [error["field"] for error in answer.json()["errors"]] == [field]


@pytest.mark.parametrize("name", FILES)
def test_files_are_known_by_their_tag_and_sent_whole_or_in_part(studies, finished_study, name):
    path = path_of(finished_study, name)
    whole = studies.get(path)
    head = studies.head(path)
    part = studies.get(path, headers={"Range": "bytes=10-29"})

    tag = whole.headers["etag"]
    assert head.status_code == 200 and head.content == b"" and head.headers["etag"] == tag
    assert int(head.headers["content-length"]) == len(whole.content)
    assert f'filename="{finished_study["id"]}' in whole.headers["content-disposition"]
    assert part.status_code == 206 and part.content == whole.content[10:30]
    assert studies.get(path, headers={"If-None-Match": tag}).status_code == 304


def test_rows_summary_comparison_and_tables_are_those_of_the_file(
    studies, finished_study, rows, tmp_path
):
    file = tmp_path / "study.mcap"
    file.write_bytes(studies.get(path_of(finished_study, "recording")).content)
    results = read_results(file)
    assert results.rows()[0] == rows
    for name, found in (
        ("summary", results.summary()),
        ("comparison", results.compare_combinations()),
    ):
        told = studies.get(path_of(finished_study, name)).json()
        assert told == plain(told) | plain(asdict(found)), name
    table, parquet = io.StringIO(), io.BytesIO()
    results.write_csv(table)
    results.write_parquet(parquet)
    assert studies.get(path_of(finished_study, "results.csv")).text == table.getvalue()
    document = studies.get(path_of(finished_study, "results.json")).json()
    assert document["rows"] == rows
    content = studies.get(path_of(finished_study, "results.parquet")).content
    assert content == parquet.getvalue()


def plain(value):
    return json.loads(json.dumps(value))


def test_the_map_is_drawn_over_the_keys_that_are_asked_for(studies, finished_study):
    path = path_of(finished_study, "map.svg")
    chosen = {"x": "fingers.0.friction", "y": "object.mass"}

    plain, turned = studies.get(path), studies.get(path, params=chosen)

    assert plain.headers["content-type"].startswith("image/svg+xml")
    assert b"<svg" in plain.content and plain.content != turned.content
    assert plain.headers["etag"] != turned.headers["etag"]
    png = studies.get(path_of(finished_study, "map.png"))
    assert png.content.startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("params", "field"),
    [
        ({"x": "object.masss"}, "x"),
        ({"x": "object.mass", "y": "object.mass"}, "y"),
        ({"z": "object.mass"}, "z"),
    ],
)
def test_a_map_over_what_does_not_vary_is_refused(studies, finished_study, params, field):
    answer = studies.get(path_of(finished_study, "map.svg"), params=params)

    (error,) = answer.json()["errors"]
    assert answer.status_code == 422 and error["field"] == field
    if field != "z":
        assert "object.mass" in error["limit"] and "fingers.0.friction" in error["limit"]


def test_any_row_becomes_a_recording_once_that_is_what_the_study_computed(
    studies, studying, finished_study, rows
):
    first = studies.post(path_of(finished_study, "results/7/recording"))
    again = studies.post(path_of(finished_study, "results/7/recording"))

    assert (first.status_code, again.status_code) == (201, 200)
    assert first.headers["location"] == again.headers["location"]
    run = studies.get(first.headers["location"].removeprefix("/api/v1")).json()
    result = read_recording(studying.data_directory / f"{run['id']}.mcap")
    assert state_hash(result) == rows[7]["state_hash"]
    assert result.scenario.object.mass == rows[7]["object.mass"]


def test_of_requests_for_one_recording_at_once_one_makes_it(studying, finished_study):
    def ask(_):
        with studying.client() as client:
            return client.post(path_of(finished_study, "results/9/recording"))

    with ThreadPoolExecutor(4) as threads:
        answers = list(threads.map(ask, range(4)))

    codes = [answer.status_code for answer in answers]
    assert codes.count(201) == 1 and set(codes) <= {200, 201, 503}
    refused = [answer.json()["detail"] for answer in answers if answer.status_code == 503]
    assert all("recording of this run is already being created" in detail for detail in refused)


def test_a_recording_in_the_making_is_given_up_when_the_server_is_to_stop(tmp_path, caplog):
    settings = patient_settings(tmp_path, study_executor="inline")
    values = {"simulation.duration": 30.0, "simulation.max_step": 0.001}
    body = {**QUICK, "set": values, "sampling": {"method": "random", "runs": 1}}
    with serve(settings) as running, running.client() as client:
        study = finished(client, create(client, body))
        running.app.state.stopping.set()
        answer = client.post(path_of(study, "results/0/recording"))

    assert answer.status_code == 503 and "about to end" in answer.json()["detail"]
    assert caplog.records == []


@pytest.mark.parametrize("index", ["40", "1000000000"])
def test_a_row_that_is_not_there_becomes_no_recording(studies, finished_study, index):
    answer = studies.post(path_of(finished_study, f"results/{index}/recording"))

    assert answer.status_code == 404 and "0 … 39, of 40 runs" in answer.json()["detail"]


@pytest.mark.parametrize("index", ["-1", "seven", "1e3", "9" * 400])
def test_what_is_no_row_is_refused(studies, finished_study, index):
    answer = studies.post(path_of(finished_study, f"results/{index}/recording"))

    assert answer.status_code == 422


def test_results_can_be_read_while_the_study_runs(tmp_path):
    settings = patient_settings(tmp_path, study_executor="inline")
    with serve(settings) as running, running.client() as client:
        study = create(client, LONG)
        until(client, study, lambda now: now["finished"] > 0)
        page = client.get(path_of(study, "results")).json()
        answers = [client.get(path_of(study, name)) for name in FILES[:4]]
        summary = client.get(path_of(study, "summary")).json()
        recorded = client.post(path_of(study, "results/0/recording"))
        still = client.get(f"/studies/{study['id']}").json()

    assert still["state"] == "running" and summary["finished"] >= page["count"] > 0
    assert [answer.status_code for answer in answers] == [200] * 4
    assert page["count"] <= len(json.loads(answers[1].text)["rows"]) <= still["finished"]
    assert recorded.status_code == 201
    assert np.isfinite(page["data"][0]["torque_effort"])
