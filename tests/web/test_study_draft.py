"""What a study from the page varies: plans, and the studies they make."""

from __future__ import annotations

from dataclasses import replace

import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario.loading import load_scenario, parameter_definitions, preset_names
from slipgrasp.core.study.loading import check_members
from slipgrasp.web.model.parameter_names import names_of
from slipgrasp.web.model.study_draft import (
    COMPARISONS,
    MAX_STEPS,
    MIN_STEPS,
    NO_COMPARISON,
    AxisDraft,
    comparisons_for,
    comparisons_in,
    fitted,
    offers_of,
    study_of,
)
from tests.web.studying import STUDY_DRAFT, quick_scenario


@pytest.mark.parametrize("name", preset_names())
def test_every_preset_offers_object_mass_and_common_friction_first(name: str) -> None:
    offers = offers_of(load_scenario(name))
    assert [offer.label for offer in offers[:2]] == ["Object mass [kg]", "Friction of all fingers"]
    assert len({offer.label for offer in offers}) == len(offers)


@pytest.mark.slow
def test_every_offer_makes_a_study_whose_runs_are_valid_over_its_own_range() -> None:
    scenarios = {name: load_scenario(name) for name in preset_names()}
    offered = {
        offer.key: (name, offer) for name in scenarios for offer in offers_of(scenarios[name])[1:]
    }
    for name, offer in offered.values():
        scenario = scenarios[name]
        study = study_of(STUDY_DRAFT.with_axis(1, offer.axis(2)), scenario, name)
        check_members(study)
        assert [study.values_of(index)[offer.key] for index in (0, 1)] == [offer.low, offer.high]
        assert study.scenario_of(0) != study.scenario_of(1)


def test_what_the_law_does_not_use_is_not_offered() -> None:
    of_paper, of_composite = (
        {offer.key for offer in offers_of(load_scenario(name))}
        for name in ("paper-case-2", "composite-case-2")
    )
    assert "controller.forgetting" in of_composite - of_paper


def test_a_plan_makes_a_grid_of_every_pair_of_values() -> None:
    study = study_of(STUDY_DRAFT, quick_scenario(), "paper-case-1")
    assert study.num_runs == STUDY_DRAFT.num_runs == 9
    assert study.recordings == "none"
    assert study.title == "paper-case-1: object mass and friction of all fingers"
    assert study.values_of(5) == {"object.mass": 1.5, "fingers.*.friction": 0.5}


def test_only_an_unchanged_preset_is_called_by_its_name() -> None:
    unchanged = load_scenario("paper-case-1")
    assert study_of(STUDY_DRAFT, unchanged, "paper-case-1").base_name == "paper-case-1"
    assert study_of(STUDY_DRAFT, quick_scenario(), "paper-case-1").base_name == ""


def test_timed_changes_of_the_draft_are_part_of_what_varies() -> None:
    scenario = load_scenario("paper-case-1").to_mapping()
    scenario["changes"] = [{"time": 0.1, "parameter": "object.mass", "value": 1.2}]
    from slipgrasp.core.scenario.loading import scenario_from_mapping

    base = scenario_from_mapping(scenario)
    study = study_of(STUDY_DRAFT, base, "paper-case-1")
    assert study.base.changes == base.changes
    assert study.title.endswith(", with timed changes")


def test_a_comparison_crosses_a_setting_with_every_pair() -> None:
    name = next(iter(COMPARISONS))
    compared = replace(STUDY_DRAFT, comparison=name)
    study = study_of(compared, quick_scenario(), "")
    assert study.num_runs == compared.num_runs == 18
    key, values = COMPARISONS[name]
    assert [study.values_of(index)[key] for index in (0, 1)] == list(values)


def test_what_an_axis_varies_is_not_offered_for_comparison() -> None:
    weight = AxisDraft("controller.lyapunov_weight", 1.0, 20.0)
    left = comparisons_for(STUDY_DRAFT.with_axis(0, weight), comparisons_in(quick_scenario()))
    assert left[0] == NO_COMPARISON
    assert len(left) == len(COMPARISONS)


def test_a_body_on_a_support_offers_no_comparison_of_controllers() -> None:
    slide = load_scenario("sliding-block")
    assert comparisons_in(slide) == ()
    compared = replace(STUDY_DRAFT, comparison=next(iter(COMPARISONS)))
    left = fitted(compared, offers_of(slide), comparisons_in(slide))
    assert (left.comparison, comparisons_for(left, ())) == (NO_COMPARISON, (NO_COMPARISON,))
    spatial = comparisons_in(load_scenario("spatial-prism"))
    assert comparisons_in(load_scenario("paper-case-1")) == tuple(COMPARISONS) == spatial


def test_numbers_of_values_stay_within_bounds_whatever_a_browser_sends() -> None:
    for count, expected in ((-5, MIN_STEPS), (10**9, MAX_STEPS)):
        study_draft = STUDY_DRAFT.with_axis(0, replace(STUDY_DRAFT.axes[0], count=count))
        assert study_draft.axes[0].count == expected


@pytest.mark.parametrize(
    ("axis", "sentence"),
    [
        (AxisDraft("object.mass", 0.0, 2.0), "object mass, from is 0; allowed: 0.001"),
        (AxisDraft("object.mass", 2.0, 1.0), "object mass has min 2 above max 1"),
        (AxisDraft("object.mass", float("nan"), 1.0), "object mass"),
        (AxisDraft("fingers.*.friction", 0.1, 1.0), "friction of all fingers is chosen twice"),
        (AxisDraft("fingers.0.friction", 0.1, 1.0), "remove one of them"),
        (AxisDraft("no.such", 0.1, 1.0), "no.such"),
    ],
)
def test_what_cannot_run_is_refused_in_the_words_of_the_page(
    axis: AxisDraft, sentence: str
) -> None:
    with pytest.raises(ScenarioError) as refused:
        study_of(STUDY_DRAFT.with_axis(0, axis), quick_scenario(), "")
    assert sentence in refused.value.errors[0].message


def test_a_plan_keeps_what_another_scenario_has_too() -> None:
    offers = offers_of(load_scenario("paper-case-1"))
    belief = AxisDraft("estimates.3.initial", 0.0, 1.0)
    kept, replaced = fitted(STUDY_DRAFT.with_axis(1, belief), offers, ()).axes
    assert kept == STUDY_DRAFT.axes[0]
    assert replaced.key in {offer.key for offer in offers} - {kept.key}


def test_beliefs_are_called_after_what_they_are_about() -> None:
    scenario = load_scenario("paper-case-2")
    assert {"fingers.0.friction"} < set(parameter_definitions(scenario))
    names = names_of(scenario)
    assert names.label("estimates.2.initial") == "initial estimate of object mass [kg]"
    assert names.label("fingers.*.link_masses.1") == "link mass 2 of all fingers [kg]"
    assert names.label("fingers.9.friction") == "fingers.9.friction"
