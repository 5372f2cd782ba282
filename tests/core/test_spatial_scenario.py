"""A scenario in space: read, written, changed and refused like one in the plane."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario.loading import (
    load_scenario,
    parameter_definitions,
    scenario_from_mapping,
    with_values,
)
from slipgrasp.core.scenario.spatial_geometry import (
    cross,
    distance_inside,
    spatial_contact,
    tip_at_start,
)
from slipgrasp.core.scenario.unknowns import name_unknown
from tests.references.spatial_scenarios import hand_of_scenario

PRISM = load_scenario("spatial-prism")


@pytest.mark.parametrize("face", PRISM.object.face_names)
def test_tangents_and_normal_of_every_face_turn_right_and_point_inwards(face):
    finger = with_values(
        PRISM, {"fingers.0.face": "side-1", "fingers.0.base": [0.7, -1.2, 0.0]}
    ).fingers[0]
    contact = spatial_contact(PRISM.object, _on(finger, face))
    assert_allclose(cross(contact.tangent_x, contact.tangent_y), contact.normal, atol=1e-15)
    for vector in (contact.tangent_x, contact.tangent_y, contact.normal):
        assert math.isclose(math.hypot(*vector), 1.0, abs_tol=1e-15)
    assert np.dot(contact.anchor, contact.normal) < 0.0
    assert distance_inside(contact.outline, (0.0, 0.0)) > 0.0


def _on(finger, face):
    from dataclasses import replace

    return replace(finger, face=face)


def test_the_middle_of_a_side_is_half_its_height_and_width_from_its_edges():
    outline = spatial_contact(PRISM.object, PRISM.fingers[0]).outline
    assert_allclose(np.ptp(outline, axis=0), [0.3, 0.2 * math.sqrt(3.0)], atol=1e-15)
    assert math.isclose(distance_inside(outline, (0.14, 0.0)), 0.01)
    assert math.isclose(distance_inside(outline, (0.0, 0.18)), 0.1 * math.sqrt(3.0) - 0.18)


def test_every_finger_of_the_prism_starts_in_the_pose_of_the_paper():
    tips = [np.add(tip_at_start(PRISM, i), f.base) for i, f in enumerate(PRISM.fingers)]
    angles = hand_of_scenario(PRISM).fingers.joint_positions(np.array(tips))
    assert_allclose(np.degrees(angles[:, 1:]), np.tile([60.0, -90.0], (3, 1)), atol=5e-3)


def test_unknowns_in_space_have_keys_and_names():
    estimates = [{"parameter": f"object.inertias.{k}", "initial": 0.02} for k in range(3)]
    mapping = PRISM.to_mapping() | {"estimates": estimates}
    scenario = scenario_from_mapping(mapping)
    assert name_unknown(scenario, "object.inertias.2").endswith("about its z axis")
    with pytest.raises(ScenarioError, match=r"object\.inertias\.K"):
        scenario_from_mapping(
            mapping | {"estimates": [{"parameter": "object.inertia", "initial": 1.0}]}
        )


def test_every_parameter_in_space_has_a_unit_and_a_sentence():
    for key, parameter in parameter_definitions(PRISM).items():
        assert parameter.text.endswith("."), key
        assert (
            parameter.kind in ("choice", "text", "boolean")
            or parameter.unit
            or key.startswith(
                ("estimates", "controller.initial_deviation", "simulation.absolute_tolerance")
            )
        ), key
