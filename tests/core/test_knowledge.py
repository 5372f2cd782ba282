"""What a controller knows: everything but its unknowns, exactly, at every instant."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario import CONTROL_LAWS, Scenario
from slipgrasp.core.scenario.custom_laws import forget
from slipgrasp.core.scenario.knowledge import knowledge_of
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.law_loading import register_law
from slipgrasp.core.scenario.loading import (
    load_scenario,
    parameter_definitions,
    scenario_from_mapping,
    with_values,
)
from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.knowledge import (
    describe_knowledge_in,
    find_nothing_to_adapt,
    knowledge_in,
)
from slipgrasp.core.study.loading import study_from_mapping
from slipgrasp.core.words.knowledge_words import describe_knowledge, list_unknowns
from tests.core.reading_knowledge import FORMS, check_knowledge
from tests.each_case import each_case

BRIEF = {"simulation.duration": 0.02}
SAMPLED = {"controller.control_period": 0.001}
EVERYTHING = "The controller was given the true friction and mass at every instant"


def told_everything(name: str, **values: object) -> Scenario:
    scenario = replace(load_scenario(name), estimates=())
    return with_values(scenario, {**BRIEF, **{k.replace("__", "."): v for k, v in values.items()}})


def changing(scenario: Scenario, **changes: object) -> Scenario:
    """A scenario in which parameters change at 10 ms; double underscores are dots."""
    values = {}
    for k, (key, value) in enumerate(changes.items()):
        values[f"changes.{k}.time"] = 0.01
        values[f"changes.{k}.parameter"] = key.replace("__", ".")
        values[f"changes.{k}.value"] = value
    return with_values(scenario, values)


@pytest.mark.parametrize("name", ["paper-case-2", "spatial-box"])
def test_without_estimates_nothing_is_unknown_and_the_verdict_says_so(name: str) -> None:
    result = simulate(told_everything(name))
    assert result.knowledge.told and result.knowledge.unknowns == ()
    assert (result.summary()["unknowns"], result.summary()["told"]) == ([], True)
    assert describe_run(result).sentences[-1] == f"{EVERYTHING}; nothing was unknown to it."


def test_what_is_estimated_is_unknown_in_the_order_of_the_scenario() -> None:
    scenario = load_scenario("paper-case-1")
    known = knowledge_of(scenario)
    assert known.unknowns == tuple(each.parameter for each in scenario.estimates)
    assert not known.told and list_unknowns(known.unknowns) == "unknown: mass, link masses"


def test_static_friction_that_is_that_of_slip_is_known() -> None:
    friction = load_scenario("paper-case-2").fingers[0].friction
    scenario = told_everything("paper-case-2", fingers__0__static_friction=friction)
    assert knowledge_of(scenario).told
    later = changing(scenario, fingers__0__friction=0.5 * friction)
    assert knowledge_of(later).unknowns == ("fingers.0.static_friction",)


def test_a_model_that_becomes_wrong_is_not_known() -> None:
    scenario = with_law(told_everything("paper-case-2"), "composite")
    assert not knowledge_of(changing(scenario, controller__link_mass_ratio=1.3)).told
    assert knowledge_of(changing(scenario, controller__grip_safety=1.3)).told


VARIANTS = {
    "nothing": {},
    "links": {"controller.link_mass_ratio": 1.2, "controller.link_length_ratio": 0.95},
    "joints": {"fingers.0.joint_friction": 0.1},
    "static": {"fingers.1.static_friction": 2.0, "fingers.1.friction": 0.3},
}


@each_case("variant", VARIANTS)
@each_case("law", CONTROL_LAWS)
@pytest.mark.parametrize("estimates", [0, 2, 4])
def test_the_sentence_says_what_the_scenario_says(variant, law, estimates) -> None:
    for name in ("paper-case-1", "paper-case-2", "wet-patch", "poured-mass", "three-fingers"):
        scenario = at_once(load_scenario(name))
        scenario = replace(scenario, estimates=scenario.estimates[:estimates])
        values = {**BRIEF, **SAMPLED, **VARIANTS[variant]}
        check_sentence(with_values(with_law(scenario, law), values))


def at_once(scenario: Scenario) -> Scenario:
    """A scenario with its patches and changes within the time that is simulated here."""
    patches = tuple(replace(each, start_time=0.0, end_time=None) for each in scenario.patches)
    changes = tuple(replace(each, time=0.01) for each in scenario.changes)
    return replace(scenario, patches=patches, changes=changes)


WRONG = {"controller.link_mass_ratio": 1.2, "controller.link_length_ratio": 0.95}
RUBBING = {"fingers.0.joint_friction": 0.1}
# Preset, places of its estimates that are kept, values: what is unknown.
NAMED = (
    ("paper-case-1", range(5), {}, "the mass of the object and the masses of the links"),
    ("paper-case-1", [0], {}, "the mass of link 1 of the left finger"),
    ("paper-case-1", [0, 1, 2], {}, "the masses of 3 of 4 links"),
    (
        *("paper-case-2", range(4), {}),
        "the friction of both fingertips and the mass and inertia of the object",
    ),
    (
        *("paper-case-2", [1, 3], {}),
        "the friction of the right fingertip and the moment of inertia of the object",
    ),
    ("three-fingers", [0, 2], {}, "the friction of the left and bottom fingertips"),
    ("spatial-box", [0, 1, 2], {}, "the friction of all fingertips"),
    ("spatial-box", [3, 4, 5, 6], {}, "the mass and inertia of the object"),
    ("spatial-box", [5], {}, "the moment of inertia of the object about its y axis"),
    (
        *("composite-case-2", [], WRONG),
        "the masses of the links (wrong in its model) and the lengths of the links "
        "(wrong in its model)",
    ),
    (
        *("composite-case-2", [], {**RUBBING, "fingers.1.static_friction": 2.0}),
        "the static friction of the right fingertip (not in its model) and the friction of the "
        "joints of the left finger (not in its model)",
    ),
    (
        *("composite-case-2", [], {**RUBBING, "fingers.1.joint_damping": 2.0}),
        "the friction of the joints of both fingers (not in its model)",
    ),
)


@pytest.mark.parametrize(("name", "kept", "values", "words"), NAMED)
def test_what_is_unknown_is_named(name, kept, values, words) -> None:
    scenario = load_scenario(name)
    scenario = replace(scenario, estimates=tuple(scenario.estimates[k] for k in kept))
    scenario = with_values(scenario, values)
    assert f"Unknown to the controller: {words}; it was" in describe_knowledge(scenario)
    check_sentence(scenario)


def check_sentence(scenario: Scenario) -> None:
    """Holds the sentence about what was unknown in a run against its scenario."""
    known, told = knowledge_of(scenario), describe_knowledge(scenario)
    (found,) = filter(None, (re.fullmatch(form, told) for form in FORMS))
    check_knowledge(scenario, known, found)


class Listener:
    """Commands nothing but what holds still, and remembers what it is shown of the truth."""

    shown: ClassVar[list[dict[str, float]]] = []

    def command(self, seen, memory, out):
        out.torque[:] = np.einsum("nij,ni->nj", seen.jacobian, 5.0 * seen.contact_normal)
        self.shown.append(given(seen.time, seen.model))


def given(time: float, model) -> dict[str, float]:
    """What a law is shown, by the key of what it is of."""
    told = {"time": time, "object.mass": model.object_mass}
    if hasattr(model, "object_inertias"):
        told |= {f"object.inertias.{k}": model.object_inertias[k] for k in range(3)}
    else:
        told["object.inertia"] = model.object_inertia
    for i in range(len(model.friction)):
        told[f"fingers.{i}.friction"] = model.friction[i]
        for k in range(2):
            told[f"fingers.{i}.link_masses.{k}"] = model.link_masses[i, k]
            told[f"fingers.{i}.link_lengths.{k}"] = model.link_lengths[i, k]
    return told


@pytest.fixture
def _listener():
    register_law(Listener)
    Listener.shown.clear()
    yield
    forget("listener")


@pytest.mark.usefixtures("_listener")
@pytest.mark.parametrize("estimates", [0, 1, 3, 5])
@pytest.mark.parametrize("ratio", [1.0, 1.25])
@pytest.mark.parametrize("name", ["three-fingers", "spatial-box"])
def test_a_law_is_shown_the_truth_of_all_that_is_not_unknown_and_of_nothing_else(
    name, ratio, estimates
) -> None:
    scenario = load_scenario(name)
    kept = tuple(replace(e, initial=1.3 * e.initial) for e in scenario.estimates[:estimates])
    scenario = with_values(
        replace(scenario, estimates=kept),
        {**BRIEF, "controller.kind": "listener", "controller.link_mass_ratio": ratio},
    )
    scenario = changing(scenario, object__mass=1.7, fingers__1__friction=0.45)
    simulate(scenario)
    known = knowledge_of(scenario)
    ticks = [{**told} for told in Listener.shown]
    assert ticks[0]["time"] < 0.01 < ticks[-1]["time"]
    wrong = {
        key
        for told in ticks
        for key, value in told.items()
        if key != "time" and value != true_value(scenario, key, told["time"])
    }
    assert wrong == set(known.unknowns)


def true_value(scenario: Scenario, key: str, time: float) -> float:
    due = [c.value for c in scenario.changes if c.parameter == key and c.time <= time]
    value = due[-1] if due else parameter_definitions(scenario)[key].value
    assert isinstance(value, float)
    return value


def study(base: Scenario, **vary: object) -> Study:
    return study_from_mapping(
        {
            "base": base.to_mapping(),
            "vary": {key.replace("__", "."): value for key, value in vary.items()},
        },
        scenario_from_mapping,
    )


MASSES = {"min": 0.8, "max": 1.6, "count": 3}


def test_a_study_without_estimates_says_that_it_compares_nothing_of_adaptation() -> None:
    blind = study(told_everything("paper-case-2"), object__mass=MASSES)
    assert knowledge_in(blind).told
    (warning,) = find_nothing_to_adapt(blind)
    assert "given the true friction and mass at every instant" in warning
    said = describe_knowledge_in(blind)
    assert said.startswith(EVERYTHING)
    assert said.endswith("This study compares no adaptation.")


def test_a_study_of_slides_says_nothing_of_controllers() -> None:
    slides = study(load_scenario("sliding-block"), object__mass=MASSES)
    assert [*find_nothing_to_adapt(slides)] == [] and describe_knowledge_in(slides) == ""


def test_a_study_with_estimates_says_what_is_unknown() -> None:
    learning = study(load_scenario("paper-case-2"), object__mass=MASSES)
    assert [*find_nothing_to_adapt(learning)] == []
    assert "nothing of adaptation" not in describe_knowledge_in(learning)
    assert knowledge_in(learning) == knowledge_of(load_scenario("paper-case-2"))


@pytest.mark.parametrize(
    ("ratios", "told"), [([1.0], True), ([1.0, 1.1], False), ([1.1, 1.2], False)]
)
def test_what_a_study_makes_wrong_in_some_run_is_not_known(ratios, told) -> None:
    base = told_everything("paper-case-2", controller__control_period=0.001)
    varied = study(base, controller__link_mass_ratio={"values": ratios})
    assert knowledge_in(varied).told is told
    # Wrong masses of links leave a law nothing to adapt.
    assert [*find_nothing_to_adapt(varied)] != []


def test_a_list_that_sets_a_parameter_in_some_runs_has_that_of_its_base_in_the_others() -> None:
    base = told_everything("paper-case-2", controller__control_period=0.001)
    base = with_values(base, {"controller.link_mass_ratio": 1.1})
    runs = [{"controller.link_mass_ratio": 1.0}, {"object.mass": 1.2}]
    document = {"base": base.to_mapping(), "sampling": {"method": "list"}, "runs": runs}
    listed = study_from_mapping(document, scenario_from_mapping)
    assert not knowledge_in(listed).told
    once = study_from_mapping({**document, "runs": runs[:1]}, scenario_from_mapping)
    assert knowledge_in(once).told
