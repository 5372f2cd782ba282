"""What is told of a study while it runs, as server-sent events."""

from __future__ import annotations

import json
import time
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Any

import pytest

from tests.server.serving import patient_settings, serve
from tests.server.studying import LONG, QUICK, create, until
from tests.waiting import wait_until

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Told:
    kind: str
    id: str
    data: Any


def read_events(lines):
    """The events of a stream, and its comments as events of the kind ``:``."""
    fields = {"event": "", "id": "", "data": "null"}
    for line in lines:
        if line.startswith(":"):
            yield Told(":", "", line)
        elif line:
            name, _, value = line.partition(": ")
            fields[name] = value
        elif fields["event"]:
            yield Told(fields["event"], fields["id"], json.loads(fields["data"]))
            fields = {"event": "", "id": "", "data": "null"}


@contextmanager
def listening(client, study, last_id=None, **params):
    headers = {} if last_id is None else {"Last-Event-ID": str(last_id)}
    path = f"/studies/{study['id']}/events"
    with client.stream("GET", path, params=params, headers=headers) as answer:
        assert answer.status_code == 200
        assert answer.headers["content-type"].startswith("text/event-stream")
        assert answer.headers["cache-control"] == "no-store"
        yield read_events(answer.iter_lines())


def all_events(client, study, last_id=None, **params):
    with listening(client, study, last_id, **params) as events:
        return list(events)


@pytest.fixture(scope="module")
def busy(tmp_path_factory):
    """A service that is at a long study, which says soon that it is still there."""
    settings = patient_settings(
        tmp_path_factory.mktemp("busy"),
        study_executor="inline",
        max_event_streams=2,
        event_heartbeat=0.1,
    )
    with serve(settings) as running, running.client() as client:
        study = create(client, LONG)
        until(client, study, lambda now: now["state"] == "running")
        yield running, client, study


def test_progress_is_told_until_the_end_with_ids_that_grow(studies):
    study = create(studies, {**QUICK, "sampling": {"method": "random", "runs": 60}})

    events = all_events(studies, study)

    assert {event.kind for event in events} == {"progress", "end"}
    assert [event.kind for event in events].index("end") == len(events) - 1
    ids = [int(event.id) for event in events if event.id]
    assert ids == sorted(set(ids)) and ids[-1] == 121
    finished_runs = [event.data["finished"] for event in events]
    assert finished_runs == sorted(finished_runs) and finished_runs[-1] == 120
    assert events[-1].data == studies.get(f"/studies/{study['id']}").json()


def test_progress_tells_rate_and_time_left_a_few_times_a_second_at_most(busy):
    _, client, study = busy
    begun, told = time.monotonic(), []

    with listening(client, study) as events:
        for event in events:
            if event.kind == "progress":
                told.append(event.data)
            if len(told) > 2 and told[-1]["rate"] is not None:
                break

    assert len(told) <= (time.monotonic() - begun) / 0.2 + 2
    assert told[-1]["rate"] > 0.0
    left = study["num_runs"] - told[-1]["finished"]
    assert told[-1]["time_left"] == pytest.approx(left / told[-1]["rate"])


def test_a_study_that_has_ended_is_told_of_in_one_event(studies, finished_study):
    (event,) = all_events(studies, finished_study)

    assert event.kind == "end" and event.data == finished_study


def test_who_has_seen_the_end_is_told_to_come_no_more(studies, finished_study):
    path = f"/studies/{finished_study['id']}/events"

    answer = studies.get(path, headers={"Last-Event-ID": "41"})

    assert answer.status_code == 204 and answer.content == b""


def test_every_row_is_told_once_in_order(studies, finished_study):
    study = create(studies, {**QUICK, "sampling": {"method": "random", "runs": 60}})

    events = all_events(studies, study, rows=True)

    rows = [row for event in events if event.kind == "rows" for row in event.data["rows"]]
    assert [row["index"] for row in rows] == list(range(120))
    page = studies.get(f"/studies/{study['id']}/results", params={"limit": 1000}).json()
    assert rows == page["data"]


@pytest.mark.parametrize("seen", [0, 20, 40])
def test_who_comes_back_is_told_the_rows_from_there_on(studies, finished_study, seen):
    events = all_events(studies, finished_study, seen, rows=True)

    rows = [row for event in events if event.kind == "rows" for row in event.data["rows"]]
    assert [row["index"] for row in rows] == list(range(seen, 40))
    assert [event.kind for event in events][-1] == "end"


def test_who_comes_back_is_not_told_again_what_it_knows(busy):
    _, client, study = busy
    known = client.get(f"/studies/{study['id']}").json()["finished"]

    with listening(client, study, known) as events:
        told = next(event for event in events if event.kind != ":")

    assert told.kind == "progress" and int(told.id) == told.data["finished"] > known


def test_who_claims_to_know_what_is_still_to_come_is_told_it_nevertheless(busy):
    _, client, study = busy

    with listening(client, study, study["num_runs"]) as events:
        told = next(event for event in events if event.kind != ":")

    assert told.kind == "progress" and told.data["finished"] < study["num_runs"]


def test_silence_is_filled_with_comments(busy):
    _, client, _ = busy
    waiting = create(client, QUICK)

    with listening(client, waiting) as events:
        assert next(events).data["state"] == "queued"
        assert [next(events).data for _ in range(3)] == [": still here"] * 3


def test_streams_are_bounded_and_a_gone_client_frees_its_place(busy):
    running, client, study = busy
    path = f"/studies/{study['id']}/events"

    with listening(client, study) as one, listening(client, study) as other:
        next(one), next(other)
        refused = client.get(path)

    assert refused.status_code == 503 and refused.headers["retry-after"] == "5"
    assert "2 streams of events are open already" in refused.json()["detail"]
    wait_until(lambda: not running.app.state.event_slots.locked())
    with listening(client, study) as again:
        assert next(again).kind == "progress"


@pytest.mark.parametrize("last_id", ["-1", "end", "1e3", "1" * 13])
def test_an_id_that_was_never_told_is_refused(studies, finished_study, last_id):
    path = f"/studies/{finished_study['id']}/events"

    answer = studies.get(path, headers={"Last-Event-ID": last_id})

    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "Last-Event-ID"


def test_a_cancelled_study_ends_its_streams(tmp_path):
    settings = patient_settings(tmp_path, study_executor="inline")
    with serve(settings) as running, running.client() as client:
        study = create(client, LONG)
        with listening(client, study) as events:
            next(events)
            client.post(f"/studies/{study['id']}/cancel")
            *_, last = events

    assert (last.kind, last.data["state"]) == ("end", "cancelled")


def test_streams_end_without_an_end_when_the_server_is_to_stop(tmp_path):
    settings = patient_settings(tmp_path, study_executor="inline")
    with ExitStack() as server:
        running = server.enter_context(serve(settings))
        client = server.enter_context(running.client())
        study = create(client, LONG)
        with running.client() as other, listening(other, study) as events:
            next(events)
            server.close()
            # Cut off, the answer would be an error here.
            assert "end" not in [event.kind for event in events]
