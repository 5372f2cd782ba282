from __future__ import annotations

import csv
import io
import json
import math
import shutil
from pathlib import Path
from typing import Any

import httpx2
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.export import write_csv
from slipgrasp.recordings.file.reader import read_recording
from tests.server.running import AT_ONCE
from tests.server.serving import LONG, patient_settings, serve
from tests.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow

SHORT = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.05}}
SEPARATES = {"scenario": "paper-case-1", "set": {"controller.position_gain": 1e6}}


def plain(value: Any) -> Any:
    return json.loads(json.dumps(value))


def test_a_posted_run_answers_with_the_summary_id_links_and_path(server, client) -> None:
    answer = client.post("/runs", json={"scenario": "paper-case-1"})
    run = answer.json()
    summary = plain(simulate(load_scenario("paper-case-1")).summary())
    assert answer.status_code == 201
    assert run["display_name"] == summary.pop("name") == "paper-case-1"
    assert summary.pop("law") is None
    assert run["name"] == ""
    assert {key: run[key] for key in summary} == summary
    assert answer.headers["location"] == run["links"]["self"] == f"/api/v1/runs/{run['id']}"
    path = Path(run["recording"])
    assert path.is_file() and path.parent == server.data_directory


def test_every_link_of_a_run_leads_somewhere(server, sample_run) -> None:
    with httpx2.Client(base_url=server.url, trust_env=False, timeout=PATIENCE) as client:
        for link in sample_run["links"].values():
            assert client.get(link).status_code == 200


def test_a_preset_sent_back_as_an_object_gives_the_same_run(client, sample_run) -> None:
    scenario = client.get("/presets/paper-case-1").json()["scenario"]
    run = client.post("/runs", json={"scenario": scenario}).json()
    assert run["metrics"] == sample_run["metrics"]
    assert Path(run["recording"]).read_bytes() == Path(sample_run["recording"]).read_bytes()


def test_a_run_that_physics_ends_early_is_created_too(client) -> None:
    answer = client.post("/runs", json=SEPARATES)
    run = answer.json()
    assert answer.status_code == 201
    assert Outcome(run["outcome"]).ended_by_physics and run["end_time"] < 7.0
    keys = {"code", "message", "contact", "time", "value", "limit", "hint"}
    assert run["reason"].keys() == keys
    assert client.get(f"/runs/{run['id']}").json() == run


def test_a_run_too_short_to_tell_whether_it_holds_is_answered_and_listed(client) -> None:
    values = {"estimates.4.initial": 1.0, "simulation.duration": 0.2}
    answer = client.post("/runs", json={"scenario": "paper-case-1", "set": values})
    assert answer.status_code == 201, answer.text
    run = answer.json()
    assert run["metrics"]["held"] is None and run["metrics"]["last_slip_time"] is None
    assert client.get(f"/runs/{run['id']}").json()["metrics"] == run["metrics"]
    assert run["id"] in [each["id"] for each in client.get("/runs").json()["data"]]


def test_a_run_beyond_the_time_limit_ends_as_limit_and_is_created(tmp_path) -> None:
    settings = patient_settings(tmp_path, wall_limit=0.3)
    with serve(settings) as running, running.client() as client:
        answer = client.post("/runs", json=LONG)
    assert answer.status_code == 201
    assert answer.json()["outcome"] == "limit"
    assert 0.0 < answer.json()["end_time"] < 600.0


def test_a_run_that_cannot_be_written_is_not_begun(tmp_path) -> None:
    blocked = tmp_path / "data"
    with serve(patient_settings(blocked)) as running, running.client() as client:
        shutil.rmtree(blocked)
        blocked.write_text("not a folder")
        answer = client.post("/runs", json={"scenario": "paper-case-1"})
        health = client.get("/health")
    assert answer.status_code == answer.json()["status"] == 507
    assert "location" not in answer.headers
    assert answer.headers["content-type"] == "application/problem+json"
    told = answer.json()["detail"]
    assert "free space on the disk" in told and "send the request again" in told
    assert str(tmp_path) not in told
    assert health.status_code == 200 and health.json()["running"] == health.json()["waiting"] == 0


def test_a_run_is_read_again_as_it_was_answered(client, sample_run) -> None:
    assert client.get(f"/runs/{sample_run['id']}").json() == sample_run


def test_the_links_of_a_page_lead_through_all_pages_and_back(tmp_path) -> None:
    short = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.01}}
    with serve(patient_settings(tmp_path)) as running, running.client() as client:
        none = {"data": [], "count": 0, "unread": 0, "links": {}}
        assert client.get("/runs").json() == none
        made = [client.post("/runs", json=short).json()["id"] for _ in range(5)]
        beyond = client.get("/runs", params={"offset": 10**9}).json()
        assert (beyond["data"], beyond["count"]) == ([], 5)
        page = client.get("/runs", params={"limit": 2, "text": "CASE I", "sort": "created"}).json()
        pages = [page]
        while "next" in page["links"]:
            page = client.get(f"{running.url}{page['links']['next']}").json()
            pages.append(page)
        ids = [[run["id"] for run in page["data"]] for page in pages]
        assert ids == [made[:2], made[2:4], made[4:]]
        before = client.get(f"{running.url}{page['links']['prev']}").json()
        assert before == pages[1] and "prev" not in pages[0]["links"]


def test_the_recording_is_downloaded_byte_for_byte(client, sample_run) -> None:
    answer = client.get(f"/runs/{sample_run['id']}/recording")
    assert answer.headers["content-type"] == "application/octet-stream"
    assert f"{sample_run['id']}.mcap" in answer.headers["content-disposition"]
    assert answer.content == Path(sample_run["recording"]).read_bytes()


def test_the_csv_file_is_the_exported_one(client, sample_run) -> None:
    answer = client.get(f"/runs/{sample_run['id']}/signals.csv")
    expected = io.StringIO()
    write_csv(read_recording(Path(sample_run["recording"])), expected)
    assert answer.headers["content-type"] == "text/csv; charset=utf-8"
    assert answer.text == expected.getvalue()


def test_all_signals_hold_every_column_of_the_csv_file_and_every_signal(client, sample_run) -> None:
    signals = client.get(f"/runs/{sample_run['id']}/signals").json()
    result = read_recording(Path(sample_run["recording"]))
    table = list(csv.DictReader(io.StringIO(client.get(sample_csv(sample_run)).text)))
    assert table[0].keys() <= signals["signals"].keys() == signals["units"].keys()
    assert len(signals["signals"]) == result.trace.shape.num_columns
    assert signals["id"] == sample_run["id"] and signals["count"] == len(table)
    for name in table[0]:
        column = [row[name] if name.startswith("phase") else float(row[name]) for row in table]
        assert signals["signals"][name] == column, name


def sample_csv(run: dict[str, Any]) -> str:
    return f"/runs/{run['id']}/signals.csv"


def test_signals_are_chosen_by_column_or_by_signal_in_the_order_asked(client, sample_run) -> None:
    names = "slip, t,times,torque_1_0,estimates,object_velocity"
    signals = client.get(f"/runs/{sample_run['id']}/signals", params={"names": names}).json()
    unknowns = list(sample_run["estimates"])
    velocity = [f"object_velocity_{name}" for name in ("x", "y", "theta")]
    estimates = [f"estimate_{key}" for key in unknowns]
    told = ["slip_0", "slip_1", "t", "torque_1_0", *estimates, *velocity]
    assert list(signals["signals"]) == told
    assert signals["units"]["torque_1_0"] == "N m"
    final = {key: signals["signals"][f"estimate_{key}"][-1] for key in unknowns}
    assert final == sample_run["estimates"]


def test_signals_of_a_segment_are_those_of_the_whole_run_between_two_times(
    client, sample_run
) -> None:
    path, names = f"/runs/{sample_run['id']}/signals", "slip_0,phase"
    whole = client.get(path, params={"names": f"t,{names}"}).json()["signals"]
    start, end = sample_run["end_time"] / 3.0, sample_run["end_time"] / 2.0
    part = client.get(path, params={"names": names, "t_from": start, "t_to": end}).json()
    inside = [start <= t <= end for t in whole.pop("t")]
    assert part["count"] == sum(inside) > 0
    expected = {
        name: [v for v, i in zip(values, inside, strict=True) if i]
        for name, values in whole.items()
    }
    assert part["signals"] == expected
    assert client.get(path, params={"t_from": -1}).status_code == 422
    assert client.get(path, params={"t_from": 900}).json()["count"] == 0


def test_an_unknown_signal_is_refused_with_the_nearest_name(client, sample_run) -> None:
    answer = client.get(f"/runs/{sample_run['id']}/signals", params={"names": "t,slop_0"})
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert error["field"] == "names" and error["value"] == "slop_0"
    assert "did you mean 'slip_0'" in error["message"]


def test_a_run_whose_file_vanished_is_not_found(server, client) -> None:
    short = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.1}}
    run = client.post("/runs", json=short).json()
    Path(run["recording"]).unlink()
    for part in ("", "/signals", "/signals.csv", "/recording"):
        answer = client.get(f"/runs/{run['id']}{part}")
        assert answer.status_code == 404
        assert answer.headers["content-type"] == "application/problem+json"
    assert run["id"] not in [listed["id"] for listed in client.get("/runs").json()["data"]]


@pytest.mark.parametrize("content", [b"", b"\x89MCAP0\r\n"])
def test_a_damaged_recording_is_said_to_be_damaged(tmp_path, content) -> None:
    (tmp_path / "abcdefghijkl.mcap").write_bytes(content)
    with serve(patient_settings(tmp_path)) as running, running.client() as client:
        listed = client.get("/runs").json()
        assert listed["count"] == 1 and listed["data"][0]["outcome"] == "failed"
        assert listed["data"][0]["reason"]["code"] == "damaged_recording"
        for part in ("signals", "signals.csv"):
            answer = client.get(f"/runs/abcdefghijkl/{part}")
            assert answer.status_code == 422 and answer.json()["errors"]
        assert client.get("/runs/abcdefghijkl/recording").content == content


def test_the_service_answers_while_it_simulates(tmp_path) -> None:
    with serve(patient_settings(tmp_path)) as running, running.client() as client:
        for _ in range(2):
            assert client.post("/runs", json=LONG, headers=AT_ONCE).status_code == 202
        wait_for_health(client, running=2)
        for path in ("/presets", "/presets/paper-case-1", "/runs", "/parameters"):
            assert client.get(path).status_code == 200
        assert client.get("/health").json()["running"] == 2


def wait_for_health(client: httpx2.Client, **wanted: Any) -> None:
    wait_until(lambda: wanted.items() <= client.get("/health").json().items(), repr(wanted))


def test_a_full_queue_is_answered_with_when_to_come_back(tmp_path) -> None:
    settings = patient_settings(tmp_path, max_running=1, max_waiting=1)
    with serve(settings) as running, running.client() as client:
        begun = [client.post("/runs", json=LONG, headers=AT_ONCE).json()]
        wait_for_health(client, running=1, waiting=0)
        begun.append(client.post("/runs", json=LONG, headers=AT_ONCE).json())
        answer = client.post("/runs", json=LONG)
        assert answer.status_code == 503 and answer.headers["retry-after"] == "5"
        assert answer.json()["status"] == 503
        for run in begun:
            client.post(f"/runs/{run['id']}/stop")
        wait_for_health(client, running=0, waiting=0)
        assert client.post("/runs", json=SHORT).status_code == 201


def test_every_number_of_an_answer_is_finite(client, sample_run) -> None:
    def refuse(word: str) -> float:
        raise AssertionError(word)

    for text in (json.dumps(sample_run), client.get(f"/runs/{sample_run['id']}/signals").text):
        json.loads(text, parse_constant=refuse)
    assert math.isfinite(sample_run["metrics"]["torque_effort"])


def test_a_posted_run_has_the_keys_of_the_contract(sample_run) -> None:
    keys = {"outcome", "reason", "end_time", "phase_changes", "estimates", "recording", "metrics"}
    assert keys | {"id", "links"} <= sample_run.keys()
    assert sample_run["phase_changes"][0].keys() == {"time", "contact", "from", "to"}
    assert sample_run["metrics"].keys() >= {
        "held",
        "slipping_at_end",
        "last_slip_time",
        "slip_path",
        "peak_normal_force",
        "minimum_friction_margin",
        "rms_tracking_error",
        "final_tracking_error",
        "torque_effort",
        "phase_change_count",
        "spin_path",
        "spin_end",
    }
    assert sample_run["outcome"] == "completed" and sample_run["reason"] is None


def test_a_link_in_the_data_folder_is_not_followed(tmp_path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("secret")
    folder = tmp_path / "data"
    folder.mkdir()
    (folder / "abcdefghijkl.mcap").symlink_to(secret)
    with serve(patient_settings(folder)) as running, running.client() as client:
        listed = client.get("/runs").json()
        assert listed == {"data": [], "count": 0, "unread": 0, "links": {}}
        assert client.get("/runs/abcdefghijkl/recording").status_code == 404
