"""Plain names of the paper's laws, accepted wherever a law is named."""

import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario.field_errors import template_keys
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.laws import CONTROL_LAWS, LAW_ALIASES, law_label
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping, with_values
from slipgrasp.core.study.loading import study_from_mapping

CHANGE = {"time": 1.0, "parameter": "controller.kind"}


@pytest.mark.parametrize(("alias", "kind"), LAW_ALIASES.items())
@pytest.mark.parametrize("preset", ["composite-case-2", "spatial-composite"])
def test_an_alias_is_the_law_everywhere(alias, kind, preset):
    base = load_scenario(preset)
    assert with_law(base, alias) == with_law(base, kind)
    named = {"controller.kind": kind, "controller.distribution": "exact"}
    aliased = {**named, "controller.kind": alias}
    assert with_values(base, aliased) == with_values(base, named)
    changed = [
        with_values(base, {**named, "changes": [{**CHANGE, "value": name}]})
        for name in (alias, kind)
    ]
    assert changed[0] == changed[1]


def test_a_study_over_laws_takes_aliases():
    vary = {"controller.kind": {"values": ["adaptive-mass", "adaptive-friction"]}}
    study = study_from_mapping({"base": "paper-case-2", "vary": vary}, load_scenario)
    kinds = [study.scenario_of(i).controller.kind for i in range(study.num_runs)]
    assert kinds == ["theorem-3", "theorem-4"]


def test_a_law_is_listed_by_its_alias_first():
    assert law_label("theorem-3") == "adaptive-mass (theorem-3)"
    assert law_label("composite") == "composite"
    assert "adaptive-mass (theorem-3): " in template_keys()["controller.kind"].text


def test_an_alias_is_no_name_of_another_law():
    assert set(LAW_ALIASES.values()) <= CONTROL_LAWS.keys()
    assert not LAW_ALIASES.keys() & CONTROL_LAWS.keys()
    with pytest.raises(ScenarioError, match="did you mean 'adaptive-mass'"):
        with_law(load_scenario("paper-case-1"), "adaptiv-mass")
    with pytest.raises(ScenarioError):
        scenario_from_mapping({"controller": {"kind": "adaptive"}})
