"""Studies through the REST interface: taken on, looked at, cancelled, deleted."""

from __future__ import annotations

import json
import re
import shutil
import threading
from concurrent.futures import ThreadPoolExecutor

import httpx2
import pytest

from slipgrasp.recordings.study.documents import StudyEnd
from slipgrasp.recordings.study.writer import StudyWriter
from slipgrasp.server.studies.schemas import read_study
from tests.server.serving import patient_settings, serve
from tests.server.studying import LONG, QUICK, create, finished, until
from tests.waiting import PATIENCE

pytestmark = pytest.mark.slow

GRID = {"base": "paper-case-1", "sampling": {"method": "grid"}}
HUGE = {
    **GRID,
    "vary": {
        "object.mass": {"min": 0.5, "max": 1.5, "count": 1_000_000},
        "fingers.0.friction": {"min": 0.1, "max": 0.9, "count": 1_000_000},
    },
}


@pytest.fixture(scope="module")
def occupied(tmp_path_factory):
    """A service that is at a long study, with a client and that study."""
    folder = tmp_path_factory.mktemp("occupied")
    settings = patient_settings(folder, study_executor="inline", max_studies_waiting=1)
    with serve(settings) as running, running.client() as client:
        study = create(client, LONG)
        until(client, study, lambda now: now["finished"] > 0)
        yield client, study, folder
        client.post(f"/studies/{study['id']}/cancel")


def test_a_study_is_taken_on_at_once_and_found_where_location_says(studies, studying):
    answer = studies.post("/studies", json=QUICK)
    study = answer.json()

    assert answer.status_code == 202
    assert answer.headers["location"] == study["links"]["self"] == f"/api/v1/studies/{study['id']}"
    assert study["num_runs"] == 40 and study["base"] == "paper-case-1"
    assert study["title"] == "Mass and friction" and study["recordings"] == "none"
    assert study["keys"] == list(QUICK["vary"])
    assert study["estimate"]["runs"] == 40 and study["estimate"]["seconds"] > 0.0
    with httpx2.Client(base_url=studying.url, trust_env=False) as client:
        assert client.get(answer.headers["location"]).status_code == 200


def test_a_finished_study_counts_its_outcomes_and_its_links_lead_somewhere(
    studying, finished_study
):
    assert finished_study["state"] == "completed"
    assert finished_study["finished"] == sum(finished_study["outcomes"].values()) == 40
    assert finished_study["rate"] is None and finished_study["time_left"] is None
    assert finished_study["message"] == "" and finished_study["warnings"] == []
    with httpx2.Client(base_url=studying.url, trust_env=False, timeout=PATIENCE) as client:
        for link in finished_study["links"].values():
            assert client.get(link).status_code == 200, link


def test_the_base_may_be_a_whole_scenario(studies):
    scenario = studies.get("/presets/paper-case-1").json()["scenario"]
    study = finished(studies, create(studies, {**QUICK, "base": scenario}))

    assert study["state"] == "completed" and study["base"] == ""


def test_an_estimate_counts_and_keeps_nothing(studies):
    before = studies.get("/studies").json()["count"]

    estimate = studies.post("/studies/estimate", json=QUICK).json()

    assert estimate["runs"] == 40 and estimate["seconds"] > 0.0 and estimate["bytes"] > 0
    assert estimate["warnings"] == []
    assert studies.get("/studies").json()["count"] == before


def test_a_study_without_estimates_is_said_to_compare_nothing_of_adaptation(studies):
    base = {**studies.get("/presets/paper-case-1").json()["scenario"], "estimates": []}
    body = {**QUICK, "base": base, "sampling": {"method": "latin-hypercube", "runs": 2}}

    (warning,) = studies.post("/studies/estimate", json=body).json()["warnings"]
    study = create(studies, body)

    assert "compares no adaptation" in warning and study["warnings"] == [warning]
    finished(studies, study)
    summary = studies.get(f"/studies/{study['id']}/summary").json()
    assert (summary["unknowns"], summary["told"]) == ([], True)


@pytest.mark.parametrize("path", ["/studies", "/studies/estimate"])
def test_a_grid_of_a_million_millions_is_refused_with_its_count(studies, path):
    answer = studies.post(path, json=HUGE)

    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert "1000000000000 runs" in answer.json()["detail"]
    assert "at most 1000000" in answer.json()["detail"]


def test_more_runs_than_this_server_takes_are_refused_with_the_way_out(studies):
    body = {**QUICK, "sampling": {"method": "random", "runs": 60_000}}

    (error,) = studies.post("/studies", json=body).json()["errors"]

    assert error["value"] == 120_000 and "at most 100000" in error["limit"]
    assert "slipgrasp study" in error["message"]


def test_thousands_of_runs_can_be_listed(studies):
    runs = [{"object.mass": 1.0 + 1e-4 * k, "fingers.0.friction": 0.5} for k in range(6000)]
    body = {"base": "paper-case-1", "sampling": {"method": "list"}, "runs": runs}

    assert studies.post("/studies/estimate", json=body).json()["runs"] == 6000


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"base": "paper-case-9"}, "base"),
        ({"base": "../secret.toml"}, "base"),
        ({"set": {"object.masss": 1.0}}, "object.masss"),
        ({"sampling": {"method": "sobol", "runs": 3}}, "sampling.method"),
        ({"sampling": {"method": "random", "runs": float("inf")}}, "sampling.runs"),
        ({"recording": "all"}, "recording"),
    ],
)
def test_a_wrong_field_is_named(studies, changes, field):
    body = {**QUICK, **changes}

    answer = studies.post(
        "/studies",
        content=json.dumps(body).encode(),
        headers={"Content-Type": "application/json"},
    )

    assert answer.status_code == 422
    assert field in [error["field"] for error in answer.json()["errors"]], answer.json()


def test_requests_with_one_key_that_arrive_at_once_make_one_study(studying):
    before = threading.Barrier(3)

    def post(_):
        with studying.client() as client:
            before.wait()
            return create(client, QUICK, key="at once")["id"]

    with ThreadPoolExecutor(3) as pool:
        assert len(set(pool.map(post, range(3)))) == 1


def test_a_key_is_not_taken_for_another_study(studies):
    study = create(studies, QUICK, key="taken")

    answer = studies.post(
        "/studies", json={**QUICK, "title": "another"}, headers={"Idempotency-Key": "taken"}
    )

    assert answer.status_code == 422
    assert study["id"] in answer.json()["detail"] and "new key" in answer.json()["detail"]


def test_studies_are_listed_newest_first_page_by_page(studies, finished_study):
    create(studies, QUICK)
    everything = studies.get("/studies").json()
    ids = [study["id"] for study in everything["data"]]
    assert ids == sorted(ids, reverse=True) and len(ids) == everything["count"] >= 2

    page = studies.get("/studies", params={"limit": 1}).json()
    assert [study["id"] for study in page["data"]] == ids[:1]
    following = studies.get(page["links"]["next"].removeprefix("/api/v1")).json()
    assert [study["id"] for study in following["data"]] == ids[1:2]
    assert following["links"]["prev"] == "/api/v1/studies?limit=1&offset=0"


def test_a_study_that_the_client_has_is_not_sent_again(studies, finished_study):
    path = f"/studies/{finished_study['id']}"
    tag = studies.get(path).headers["etag"]

    assert studies.get(path, headers={"If-None-Match": tag}).status_code == 304
    assert studies.get(path, headers={"If-None-Match": '"other"'}).status_code == 200


@pytest.mark.parametrize("study_id", ["abcdefghijkl", "..", "%2e%2e%2fetc", "%00", "X" * 300])
@pytest.mark.parametrize(
    ("method", "rest"),
    [
        ("GET", ""),
        ("DELETE", ""),
        ("POST", "/cancel"),
        ("GET", "/events"),
        ("GET", "/results"),
        ("GET", "/results.csv"),
        ("GET", "/map.svg"),
        ("GET", "/recording"),
        ("POST", "/results/0/recording"),
    ],
)
def test_an_unknown_study_is_not_found(studies, method, rest, study_id):
    answer = studies.request(method, f"/studies/{study_id}{rest}")

    assert answer.status_code in (404, 405)
    assert answer.headers["content-type"] == "application/problem+json"


def test_cancelling_ends_a_study_in_the_middle_for_the_next_and_can_be_repeated(tmp_path):
    settings = patient_settings(tmp_path, study_executor="inline")
    with serve(settings) as running, running.client() as client:
        study, waiting = create(client, LONG), create(client, QUICK)
        until(client, study, lambda now: now["finished"] > 0)
        answers = [client.post(f"/studies/{study['id']}/cancel") for _ in range(2)]
        ended = finished(client, study)
        page = client.get(f"/studies/{study['id']}/results").json()
        client.get(f"/studies/{study['id']}/recording").raise_for_status()
        assert client.post(f"/studies/{study['id']}/cancel").json() == ended
        assert finished(client, waiting)["state"] == "completed"

    assert [answer.status_code for answer in answers] == [202, 202]
    assert ended["state"] == "cancelled" and 0 < ended["finished"] < study["num_runs"]
    assert page["count"] == ended["finished"] == sum(ended["outcomes"].values())


def test_one_study_runs_at_a_time_and_those_that_wait_are_bounded(occupied):
    client, study, _ = occupied
    waiting = create(client, QUICK)
    refused = client.post("/studies", json=QUICK)
    none_yet = client.post(f"/studies/{waiting['id']}/results/0/recording")
    cancelled = client.post(f"/studies/{waiting['id']}/cancel").json()
    assert waiting["state"] == "queued" and waiting["rate"] is None
    assert refused.status_code == 503 and refused.headers["retry-after"] == "5"
    assert "1 studies or fits are waiting already" in refused.json()["detail"]
    assert none_yet.status_code == 404
    assert "no result of run 0, and none yet of any, of 40 runs" in none_yet.json()["detail"]
    assert cancelled["state"] == "cancelled" and cancelled["finished"] == 0
    assert client.get(f"/studies/{study['id']}").json()["state"] == "running"


def test_a_study_whose_file_is_complete_has_ended_as_that_says(occupied):
    client, _, folder = occupied
    waiting = create(client, QUICK)
    # As if the service had failed between the end of the file and its own note of it.
    file = folder / "studies" / f"{waiting['id']}.mcap"
    with StudyWriter(file, read_study(QUICK, 1000)) as writer:
        writer.finish(StudyEnd(state="cancelled", runs=0, outcomes={}, message="elsewhere"))

    ended = client.post(f"/studies/{waiting['id']}/cancel").json()

    assert (ended["state"], ended["message"]) == ("cancelled", "elsewhere")
    assert "recording" in ended["links"]


def test_a_study_that_may_not_find_room_is_told_how_much_it_may_take(tmp_path):
    settings = patient_settings(tmp_path, study_executor="inline", quota_bytes=3_000_000)
    body = {**QUICK, "recordings": "all", "sampling": {"method": "random", "runs": 1000}}
    with serve(settings) as running, running.client() as client:
        (warning,) = client.post("/studies/estimate", json=body).json()["warnings"]

    assert re.search(r"of their quota of 3 MB, and there is no space for \S+ [MG]B more", warning)


def test_an_unfinished_study_is_neither_deleted_nor_downloaded(occupied):
    client, study, _ = occupied

    for answer in (
        client.delete(f"/studies/{study['id']}"),
        client.get(f"/studies/{study['id']}/recording"),
    ):
        assert answer.status_code == 409
        assert f"POST /api/v1/studies/{study['id']}/cancel" in answer.json()["detail"]


def test_a_deleted_study_is_gone_and_recordings_of_its_runs_stay(studies):
    study = finished(studies, create(studies, QUICK))
    run = studies.post(f"/studies/{study['id']}/results/1/recording").json()

    assert studies.delete(f"/studies/{study['id']}").status_code == 204

    for rest in ("", "/results", "/recording"):
        assert studies.get(f"/studies/{study['id']}{rest}").status_code == 404
    assert studies.delete(f"/studies/{study['id']}").status_code == 404
    assert studies.get(f"/runs/{run['id']}").status_code == 200


def test_a_study_whose_rows_cannot_be_written_has_failed_with_the_reason(tmp_path):
    settings = patient_settings(tmp_path, study_executor="inline")
    with serve(settings) as running, running.client() as client:
        long = create(client, LONG)
        waiting = create(client, QUICK)
        shutil.rmtree(tmp_path / "studies")
        (tmp_path / "studies").write_text("not a folder")
        client.post(f"/studies/{long['id']}/cancel")
        failed = finished(client, waiting)
        assert client.get("/health").status_code == 200

    assert failed["state"] == "failed" and "cannot write" in failed["message"]
    assert "Traceback" not in failed["message"]


def test_no_study_is_resumed_that_there_is_not(studies):
    assert studies.post("/studies/aaaaaaaaaaaa/resume").status_code == 404
