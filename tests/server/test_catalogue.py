"""Presets, parameters, health and the description of the interface."""

from __future__ import annotations

import pytest

from slipgrasp.core.scenario.loading import (
    all_preset_names,
    load_scenario,
    parameter_definitions,
    scenario_from_mapping,
)


def test_health_says_that_the_service_is_up(client) -> None:
    health = client.get("/health").json()
    assert health["status"] == "ok" and health["kernel"] in ("ready", "compiling")
    assert health["version"] and health["running"] == health["waiting"] == 0


def test_presets_are_listed_with_where_to_find_them(server, client) -> None:
    listed = client.get("/presets").json()
    assert [preset["name"] for preset in listed["data"]] == list(all_preset_names())
    assert listed["count"] == len(all_preset_names())
    for preset in listed["data"]:
        answer = client.get(f"{server.url}{preset['links']['self']}")
        assert answer.status_code == 200 and answer.json()["title"] == preset["title"]
        scenario = scenario_from_mapping(answer.json()["scenario"])
        assert scenario == load_scenario(preset["name"])


@pytest.mark.parametrize("name", all_preset_names())
def test_parameters_are_those_of_the_scenario_with_unit_bounds_and_text(client, name) -> None:
    listed = client.get("/parameters", params={"preset": name}).json()
    by_key = {parameter["key"]: parameter for parameter in listed["data"]}
    definitions = parameter_definitions(load_scenario(name))
    of_lists = {"changes.0.time"}
    if "pulses" in load_scenario(name).to_mapping():
        of_lists.add("pulses.0.force.1")
    if load_scenario(name).space.has_hand:
        of_lists.add("patches.0.friction_factor")
    assert definitions.keys() | of_lists <= by_key.keys()
    assert listed["count"] == len(by_key)
    for key, definition in definitions.items():
        shown = by_key[key]
        assert shown["unit"] == definition.unit and shown["text"] == definition.text
        assert (shown["minimum"], shown["maximum"]) == (definition.minimum, definition.maximum)
        assert shown["choices"] == list(definition.choices)


def test_a_boolean_parameter_has_its_kind_and_its_value(client) -> None:
    listed = client.get("/parameters", params={"preset": "paper-case-1"}).json()["data"]
    (shown,) = (each for each in listed if each["key"] == "sensing.true_phases")
    assert (shown["kind"], shown["limit"]) == ("boolean", "true or false")
    assert shown["value"] is True


def test_parameters_of_an_unknown_preset_are_refused(client) -> None:
    answer = client.get("/parameters", params={"preset": "paper-case-9"})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["limit"] == "one of " + ", ".join(all_preset_names())


def test_the_documentation_is_served_without_anything_from_outside(client) -> None:
    for name, kind in (("docs", "html"), ("docs.js", "javascript"), ("docs.css", "css")):
        answer = client.get(f"/{name}")
        assert answer.status_code == 200 and kind in answer.headers["content-type"]
        assert "//" not in answer.text.replace("// ", "") and "http" not in answer.text


def test_the_description_lists_every_route_and_its_problems(client) -> None:
    document = client.get("/openapi.json").json()
    assert document["openapi"].startswith("3.")
    assert set(document["paths"]) == {
        "/api/v1/health",
        "/api/v1/ready",
        "/api/v1/presets",
        "/api/v1/presets/{name}",
        "/api/v1/parameters",
        "/api/v1/runs",
        "/api/v1/runs/{run_id}",
        "/api/v1/runs/{run_id}/stop",
        "/api/v1/runs/{run_id}/signals",
        "/api/v1/runs/{run_id}/signals.csv",
        "/api/v1/runs/{run_id}/signals.parquet",
        "/api/v1/runs/{run_id}/signals.npz",
        "/api/v1/runs/{run_id}/recording",
        "/api/v1/recordings",
        "/api/v1/fits",
        "/api/v1/fits/{fit_id}",
        "/api/v1/fits/{fit_id}/cancel",
        "/api/v1/fits/{fit_id}/resume",
        "/api/v1/fits/{fit_id}/events",
        "/api/v1/fits/{fit_id}/recording",
        "/api/v1/fits/{fit_id}/report.html",
        "/api/v1/fits/{fit_id}/report.json",
        "/api/v1/studies",
        "/api/v1/studies/estimate",
        "/api/v1/studies/{study_id}",
        "/api/v1/studies/{study_id}/cancel",
        "/api/v1/studies/{study_id}/resume",
        "/api/v1/studies/{study_id}/events",
        "/api/v1/studies/{study_id}/results",
        "/api/v1/studies/{study_id}/results.csv",
        "/api/v1/studies/{study_id}/results.json",
        "/api/v1/studies/{study_id}/results.parquet",
        "/api/v1/studies/{study_id}/results/{index}/recording",
        "/api/v1/studies/{study_id}/summary",
        "/api/v1/studies/{study_id}/comparison",
        "/api/v1/studies/{study_id}/map.svg",
        "/api/v1/studies/{study_id}/map.png",
        "/api/v1/studies/{study_id}/recording",
        "/api/v1/diff",
        "/api/v1/diff/figure",
    }
    posting = document["paths"]["/api/v1/runs"]["post"]
    assert posting["requestBody"]["content"]["application/json"]["schema"] == {
        "$ref": "#/components/schemas/RunCreate"
    }
    schema = document["components"]["schemas"]["RunCreate"]
    assert schema["properties"].keys() == {"scenario", "law", "set"} and schema["example"]
    assert {"201", "400", "413", "415", "422", "503"} <= posting["responses"].keys()
    assert "application/problem+json" in posting["responses"]["422"]["content"]
