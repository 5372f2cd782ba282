"""The description of the interface is good enough for other programs to make a client of it."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import httpx2
import pytest

from tests.server.studying import finished
from tests.waiting import PATIENCE

pytestmark = pytest.mark.slow

METHODS = ("get", "post", "put", "patch", "delete", "head", "options")
PROBLEM = "application/problem+json"

# What the generator does not know is bytes like any other.
CONFIG = {
    "package_name_override": "generated_client",
    "post_hooks": [],
    "content_type_overrides": {
        kind: "application/octet-stream"
        for kind in (
            "application/vnd.apache.parquet",
            "application/x-mcap",
            "image/png",
            "image/svg+xml",
        )
    },
}


@pytest.fixture(scope="module")
def document(studying) -> dict[str, Any]:
    with studying.client() as client:
        found: dict[str, Any] = client.get("/openapi.json").json()
    return found


@pytest.fixture(scope="module")
def operations(document) -> dict[str, dict[str, Any]]:
    return {
        f"{method.upper()} {path}": operation
        for path, methods in document["paths"].items()
        for method, operation in methods.items()
        if method in METHODS
    }


@pytest.fixture(scope="module")
def api(document, tmp_path_factory) -> Iterator[Any]:
    """The generated package; ``api("runs.create_run")`` is one of its modules."""
    folder = tmp_path_factory.mktemp("generated")
    (folder / "openapi.json").write_text(json.dumps(document))
    (folder / "config.json").write_text(json.dumps(CONFIG))
    command = [sys.executable, "-m", "openapi_python_client", "generate", "--fail-on-warning"]
    options = ["--meta", "none", "--path", "openapi.json", "--config", "config.json"]
    output = ["--output-path", "generated_client"]
    done = subprocess.run(
        [*command, *options, *output], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "WARNING" not in done.stdout + done.stderr
    sys.path.insert(0, str(folder))
    try:
        yield part_of_generated
    finally:
        sys.path.remove(str(folder))


def part_of_generated(name: str) -> ModuleType:
    return importlib.import_module(f"generated_client.{name}")


@pytest.fixture
def connection(api, studying) -> Iterator[Any]:
    options = {"base_url": studying.url, "timeout": PATIENCE, "httpx_args": {"trust_env": False}}
    with api("client").Client(**options) as client:
        yield client


def test_every_operation_has_a_name_of_its_own_a_tag_and_a_sentence(document, operations) -> None:
    names = [operation["operationId"] for operation in operations.values()]
    assert len(set(names)) == len(names) and all(name.isidentifier() for name in names)
    tags = {tag["name"] for tag in document["tags"] if tag["description"]}
    assert {tag for operation in operations.values() for tag in operation["tags"]} == tags
    assert [o for o in operations.values() if not o.get("description")] == []


def test_every_error_is_described_as_a_problem(operations) -> None:
    for name, operation in operations.items():
        for status, response in operation["responses"].items():
            if int(status) >= 400:
                assert list(response["content"]) == [PROBLEM], f"{name} {status}"
                schema = response["content"][PROBLEM]["schema"]
                assert schema == {"$ref": "#/components/schemas/ProblemPublic"}, f"{name} {status}"


def test_every_answer_and_body_has_a_schema(operations) -> None:
    for name, operation in operations.items():
        answers = list(operation["responses"].values())
        for part in [*answers, operation.get("requestBody", {})]:
            assert all(media.get("schema") for media in part.get("content", {}).values()), name


def test_every_reference_leads_somewhere_and_every_schema_is_referred_to(document) -> None:
    text = json.dumps(document)
    known = set(document["components"]["schemas"])
    referred = {part.split('"')[0] for part in text.split("#/components/schemas/")[1:]}
    assert referred == known
    assert '"#/$defs' not in text and "HTTPValidationError" not in text


def test_every_file_can_be_asked_for_in_parts(operations) -> None:
    ends = ("/recording", ".csv", ".parquet", ".npz", ".json", ".svg", ".png")
    files = {n: o for n, o in operations.items() if n.startswith("GET") and n.endswith(ends)}
    assert len(files) >= 10
    for name, operation in files.items():
        asked = {p["name"] for p in operation["parameters"] if p["in"] == "header"}
        assert {"Range", "If-Range", "If-Match", "If-None-Match"} <= {a.title() for a in asked}
        assert {"200", "206", "304", "412", "416"} <= operation["responses"].keys(), name


def test_enumerations_bounds_and_nulls_are_told(document) -> None:
    schemas = document["components"]["schemas"]
    assert {"completed", "stopped", "left_face"} <= set(schemas["Outcome"]["enum"])
    assert schemas["RunState"]["enum"] == ["waiting", "running"]
    pending = schemas["PendingRunPublic"]["properties"]
    assert (pending["progress"]["minimum"], pending["progress"]["maximum"]) == (0.0, 1.0)
    assert {"type": "null"} in schemas["RunPublic"]["properties"]["id"]["anyOf"]
    assert schemas["RunCreate"]["example"] and schemas["RunUpdate"]["example"]


def test_a_generated_client_simulates_searches_changes_and_deletes(api, connection) -> None:
    models = api("models")
    values = models.RunCreateSet.from_dict({"simulation.duration": 0.05, "object.mass": 1.1})
    wanted = models.RunCreate(scenario="paper-case-1", set_=values)
    made = api("api.runs.create_run").sync_detailed(client=connection, body=wanted)
    assert made.status_code == 201 and made.headers["location"].endswith(made.parsed.id)
    run = made.parsed
    assert isinstance(run, models.RunPublic) and run.outcome is models.Outcome.COMPLETED
    assert run.metrics.slipping_at_end and run.reason is None

    found = api("api.runs.list_runs").sync(client=connection, metric=["held=false"], limit=1)
    assert [each.id for each in found.data] == [run.id]
    update = models.RunUpdate(name="by a generated client", tags=["generated"])
    changed = api("api.runs.update_run").sync(run.id, client=connection, body=update)
    assert (changed.name, changed.tags) == ("by a generated client", ["generated"])
    assert api("api.runs.read_run").sync(run.id, client=connection) == changed

    gone = api("api.runs.delete_run").sync_detailed(run.id, client=connection)
    assert gone.status_code == 204
    problem = api("api.runs.read_run").sync(run.id, client=connection)
    assert isinstance(problem, models.ProblemPublic) and problem.status == 404


def test_a_generated_client_is_told_what_is_wrong(api, connection) -> None:
    models = api("models")
    values = models.RunCreateSet.from_dict({"object.mass": -1.0})
    wanted = models.RunCreate(scenario="paper-case-1", set_=values)
    problem = api("api.runs.create_run").sync(client=connection, body=wanted)
    assert isinstance(problem, models.ProblemPublic) and problem.status == 422
    assert problem.errors[0].field == "object.mass"


def test_a_generated_client_downloads_files_and_parts_and_uploads(api, connection) -> None:
    models, types = api("models"), api("types")
    wanted = models.RunCreate(scenario="paper-case-1")
    run = api("api.runs.create_run").sync(client=connection, body=wanted)
    whole = api("api.runs.read_recording_file").sync(run.id, client=connection)
    content = whole.payload.read()
    assert len(content) == run.size
    read = api("api.runs.read_recording_file").sync
    assert read(run.id, client=connection, range_="bytes=0-7").payload.read() == content[:8]
    table = api("api.runs.read_signals_as_csv").sync(run.id, client=connection)
    assert table.startswith("t,") and table.count("\n") > 1000
    parquet = api("api.runs.read_signals_as_parquet").sync(run.id, client=connection)
    assert parquet.payload.read(4) == b"PAR1"
    slip = api("api.runs.read_signals").sync(run.id, client=connection, names="t,slip_0")
    assert slip.count == len(slip.signals["slip_0"])

    body = types.File(payload=content, file_name="case.mcap")
    uploaded = api("api.recordings.upload_recording").sync(
        client=connection, body=body, name="again"
    )
    assert uploaded.name == "again" and uploaded.metrics == run.metrics


def test_a_generated_client_makes_a_study_and_reads_its_results(api, connection, studying) -> None:
    models = api("models")
    wanted = models.StudyDocument.from_dict(
        {
            "title": "by a generated client",
            "base": "paper-case-1",
            "set": {"simulation.duration": 0.02},
            "sampling": {"method": "grid"},
            "recordings": "none",
            "vary": {"object.mass": {"min": 1.0, "max": 1.4, "count": 5}},
        }
    )
    created = api("api.studies.create_study").sync(client=connection, body=wanted)
    assert isinstance(created, models.StudyPublic) and created.num_runs == 5
    with studying.client() as client:
        assert finished(client, created.to_dict())["state"] == "completed"
    study = api("api.studies.read_study_status").sync(created.id, client=connection)
    assert study.state is models.StudyState.COMPLETED and study.finished == 5
    results = api("api.studies.read_study_results")
    page = results.sync(created.id, client=connection, limit=2, offset=3)
    assert [row["object.mass"] for row in page.data] == pytest.approx([1.3, 1.4])


def test_the_headers_of_the_description_are_those_that_are_sent(
    studying, operations, tmp_path
) -> None:
    with studying.client() as client:
        run = client.post("/runs", json={"scenario": "paper-case-1"})
        told = operations["GET /api/v1/runs/{run_id}/recording"]["responses"]["200"]
        answer = client.get(f"/runs/{run.json()['id']}/recording")
        assert list(told["content"]) == [answer.headers["content-type"]]
        assert {name.lower() for name in told["headers"]} <= set(answer.headers)
        assert isinstance(answer, httpx2.Response)
