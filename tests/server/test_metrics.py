"""What Prometheus is told, and that it is let in like everybody else."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from prometheus_client.parser import text_string_to_metric_families

from slipgrasp.server.exceptions import SettingsError
from slipgrasp.server.settings import Settings
from slipgrasp.server.tokens import Tokens
from tests.server.raw_http import Answer, exchange, get
from tests.server.running import AT_ONCE
from tests.server.serving import LONG, RunningServer, patient_settings, serve

TOKENS = Tokens("the-token-of-these-tests")
SHORT = {"scenario": "paper-case-1", "set": {"simulation.duration": 0.01}}


@pytest.fixture
def measured(tmp_path) -> Iterator[RunningServer]:
    settings = patient_settings(tmp_path, metrics=True, max_running=1, token=TOKENS.full)
    with serve(settings) as running:
        yield running


def ask(server: RunningServer, *headers: tuple[str, str]) -> Answer:
    return get(server.port, "/metrics", [("Host", f"127.0.0.1:{server.port}"), *headers])


def samples(server: RunningServer) -> dict[tuple[str, ...], float]:
    """Values by name and labels, in the order of the labels' names."""
    text = ask(server).body.decode()
    return {
        (sample.name, *(value for _, value in sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
    }


def test_how_busy_the_service_is_can_be_read(measured) -> None:
    with measured.client() as client:
        assert client.post("/runs", json=SHORT).status_code == 201
        for _ in range(3):
            client.post("/runs", json=LONG, headers=AT_ONCE)
        found = samples(measured)
    assert found[("slipgrasp_runs_stored",)] == 1 and found[("slipgrasp_ready",)] == 1
    assert found[("slipgrasp_runs_running",)] + found[("slipgrasp_runs_waiting",)] == 3
    assert found[("slipgrasp_studies_unfinished",)] == found[("slipgrasp_runs_recovering",)] == 0
    assert found[("slipgrasp_disk_free_bytes",)] > 0
    assert found[("process_resident_memory_bytes",)] > 1e7


def test_answers_are_counted_by_method_and_status_those_to_strangers_too(measured) -> None:
    with measured.client() as client:
        for _ in range(3):
            client.get("/health")
        client.get("/runs/nothing-here")
    ask(measured, ("Authorization", "Bearer wrong"))
    port = measured.port
    exchange(port, f"BREW /api/v1/health HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
    found = samples(measured)
    name = "slipgrasp_http_answers_total"
    assert found[(name, "GET", "200")] == 3
    assert found[(name, "GET", "404")] == found[(name, "GET", "401")] == 1
    assert found[(name, "other", "405")] == 1
    assert found[("slipgrasp_http_answer_seconds_count",)] == 6
    assert 0.0 < found[("slipgrasp_http_answer_seconds_sum",)] < 600.0


def test_metrics_are_for_those_who_may_look(measured) -> None:
    assert ask(measured, ("Authorization", "Bearer wrong")).status == 401
    looking = ask(measured, ("Authorization", f"Bearer {TOKENS.read_only}"))
    assert looking.status == 200 and looking.headers["content-type"].startswith("text/plain")
    assert str(measured.data_directory) not in looking.body.decode()


def test_without_being_asked_for_there_are_none(server) -> None:
    assert ask(server).status == 404


def test_without_the_package_that_writes_them_the_way_out_is_told(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("slipgrasp.server.settings.find_spec", lambda name: None)
    with pytest.raises(SettingsError, match=r"slipgrasp\[metrics\]"):
        Settings(data_directory=tmp_path, metrics=True)
