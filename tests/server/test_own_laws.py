"""A request names a law that the service was started with; it never brings code or a path."""

import pytest

from slipgrasp.core.scenario.law_loading import register_law
from slipgrasp.core.scenario.own_laws import forget


class Offered:
    """Commands nothing."""

    def command(self, seen, memory, out):
        pass


@pytest.fixture
def _offered():
    register_law(Offered)
    yield
    forget("offered")


@pytest.mark.parametrize(
    "kind",
    [
        "nobody-knows",
        "outside",
        "law.py:Carry",
        "/etc/passwd",
        "../law.py",
        "class X: pass",
        "gASVx.",
    ],
)
def test_a_request_with_code_a_path_or_an_unknown_name_is_refused(client, kind):
    asked = {"scenario": "composite-case-2", "set": {"controller.kind": kind}}
    answer = client.post("/runs", json=asked)
    assert answer.status_code == 422
    assert "controller.kind" in answer.text
    study = {"base": "composite-case-2", "vary": {"controller.kind": {"values": [kind]}}}
    assert client.post("/studies", json=study).status_code == 422
    assert client.post("/studies", json={**study, "law": kind}).status_code == 422


def test_a_law_that_is_offered_runs_under_its_name(client, _offered):
    asked = {"scenario": "composite-case-2", "set": {"controller.kind": "offered"}}
    answer = client.post("/runs", json=asked, headers={"Prefer": "wait=30"})
    assert answer.status_code in (200, 201)
    assert answer.json()["outcome"] == "separated"
