"""Runs are named by their preset and what they do otherwise."""

from dataclasses import replace

import pytest

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.laws import CONTROL_LAWS
from slipgrasp.core.scenario.loading import load_scenario, preset_names, with_values
from slipgrasp.core.words.display_name import file_stem, name_run
from tests.core.drawn_scenarios import KINDS, draw_scenario

CASE_2 = load_scenario("paper-case-2")
MASS_LATER = {"changes.0.time": 3, "changes.0.parameter": "object.mass", "changes.0.value": 1.6}

FACTS = [
    ({"object.mass": 1.4}, "mass 1.4 kg"),
    ({"object.inertia": 0.02}, "inertia 0.02 kg m²"),
    ({"fingers.0.friction": 0.3}, "left friction 0.3"),
    ({"fingers.0.friction": 0.3, "fingers.1.friction": 0.3}, "friction 0.3"),
    (
        {"fingers.0.friction": 0.3, "fingers.1.friction": 0.4},
        "left friction 0.3 · right friction 0.4",
    ),
    ({"fingers.1.link_masses.1": 0.6}, "right link mass 2: 0.6 kg"),
    ({"estimates.2.initial": 0.7}, "initial estimate of mass 0.7 kg"),
    ({"estimates.0.initial": 0.7, "estimates.1.initial": 0.7}, "initial estimate of friction 0.7"),
    ({"estimates.0.maximum": 2.0}, "largest estimate of left friction 2"),
    ({"trajectory.acceleration.1": 0.1}, "acceleration (0, 0.1, 0) m/s²"),
    ({"trajectory.kind": "shake"}, "shake motion"),
    ({"pulses.0.time": 0.08}, "push at 0.08 s"),
    ({"pulses.0.time": 0.08, "pulses.0.force.1": -8.0}, "push (0, -8) N at 0.08 s"),
    ({"patches.0.face": "left", "patches.0.start_time": 3}, "low-friction patch on left at 3 s"),
    (
        {"patches.0.face": "left", "patches.0.friction_factor": 1.5},
        "high-friction patch on left × 1.5",
    ),
    (MASS_LATER, "mass 1.6 kg at 3 s"),
    (
        {
            "changes.0.time": 2,
            "changes.0.parameter": "estimates.0.initial",
            "changes.0.value": 0.3,
        },
        "initial estimate of left friction 0.3 at 2 s",
    ),
    ({"simulation.gravity": 1.62}, "gravity 1.62 m/s²"),
    (
        {"controller.control_period": 0.001, "actuation.torque_limit": 20.0},
        "control period 0.001 s · torque limit 20 N m",
    ),
    (
        {"controller.control_period": 0.001, "controller.link_mass_ratio": 1.1},
        "control period 0.001 s · link mass ratio 1.1",
    ),
]


@pytest.mark.parametrize("name", preset_names())
def test_a_run_of_a_preset_as_it_comes_is_called_like_the_preset(name):
    assert name_run(load_scenario(name)) == name


@pytest.mark.parametrize(("values", "words"), FACTS, ids=[words for _, words in FACTS])
def test_what_differs_from_the_preset_is_said_with_its_unit(values, words):
    assert name_run(with_values(CASE_2, values)) == f"paper-case-2 · {words}"


def test_the_law_comes_first_then_the_world_then_what_happens_then_details():
    values = {
        "simulation.duration": 4.0,
        **MASS_LATER,
        "object.mass": 1.4,
        "controller.kind": "theorem-3",
    }

    assert name_run(with_values(CASE_2, values)) == (
        "paper-case-2 · theorem-3 · mass 1.4 kg · mass 1.6 kg at 3 s · duration 4 s"
    )


def test_of_many_differences_the_first_are_said_and_the_others_counted():
    values = {
        "object.mass": 1.4,
        "controller.kind": "composite",
        "controller.control_period": 0.002,
        "controller.grip_safety": 1.2,
        "pulses.0.time": 0.08,
        "simulation.duration": 3.0,
    }

    assert name_run(with_values(CASE_2, values)) == (
        "paper-case-2 · composite · mass 1.4 kg · push at 0.08 s · +3 more"
    )


def test_what_a_preset_has_and_the_run_has_not_is_said_too():
    poured, wet = load_scenario("poured-mass"), load_scenario("wet-patch")

    assert name_run(replace(wet, patches=())) == "wet-patch · no low-friction patch on left at 3 s"
    assert name_run(replace(poured, changes=poured.changes[1:])) == (
        "poured-mass · no mass 1.6 kg at 3 s"
    )
    other = with_values(poured, {"changes.0.value": 1.8})
    assert name_run(other) == "poured-mass · mass 1.8 kg at 3 s"
    known = replace(poured, estimates=poured.estimates[:-1])
    assert name_run(known) == "poured-mass · inertia not estimated"


@pytest.mark.parametrize("kind", CONTROL_LAWS)
def test_what_comes_with_a_law_is_not_said_beside_it(kind):
    chosen = with_law(CASE_2, kind)
    law = "" if kind == CASE_2.controller.kind else f" · {kind}"

    assert name_run(chosen) == f"paper-case-2{law}"
    heavier = with_values(chosen, {"object.mass": 1.4})
    assert name_run(heavier) == f"paper-case-2{law} · mass 1.4 kg"


def test_a_scenario_without_the_title_is_named_by_the_preset_it_is_nearest_to():
    assert name_run(with_values(CASE_2, {"title": "", "object.mass": 2.0})) == (
        "paper-case-2 · mass 2 kg"
    )
    assert name_run(with_values(CASE_2, {"title": "In the lab", "object.mass": 2.0})) == (
        "In the lab · mass 2 kg"
    )


def test_a_scenario_like_no_preset_is_named_by_its_own_title_law_hand_and_object():
    drawn = replace(draw_scenario(KINDS[-1], 1), pulses=(), patches=(), changes=())
    mass = f"mass {drawn.object.mass:g} kg"
    facts = f"{drawn.controller.kind} · {len(drawn.fingers)} fingers · {mass}"

    assert name_run(replace(drawn, title="")) == f"own scenario · {facts}"
    assert name_run(replace(drawn, title="a\nb " + 60 * "x")).startswith(f"a b {43 * 'x'}… · ")


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS, ids=str)
def test_every_scenario_has_a_name_of_one_line_that_fits_its_place(kind):
    for seed in range(3):
        name = name_run(draw_scenario(kind, seed))
        assert name.isprintable() and 0 < len(name) <= 200
        stem = file_stem(name)
        assert stem.isascii() and 0 < len(stem) <= 60


@pytest.mark.parametrize(
    ("name", "stem"),
    [
        ("paper-case-2 · mass 1.4 kg", "paper-case-2-mass-1.4-kg"),
        ("inertia 0.02 kg m²", "inertia-0.02-kg-m2"),
        ("../../etc/passwd", "etc-passwd"),
        ("grün ✓", "gr-n"),
        ("✓", ""),
        ("word " * 20, "-".join(["word"] * 12)),
        ("x" * 80, "x" * 60),
        ("a" * 50 + " 12345678901234", "a" * 50),
    ],
)
def test_a_name_becomes_part_of_a_file_name_without_cut_numbers(name, stem):
    assert file_stem(name) == stem


def test_hands_of_other_numbers_of_fingers_are_named():
    three: Scenario = load_scenario("three-fingers")
    two = replace(three, fingers=three.fingers[:2], estimates=())

    assert "2 fingers" in name_run(two)
