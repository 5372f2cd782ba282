"""Objects with any convex outline: their faces, what is refused, and the same physics."""

import math

import numpy as np
import pytest

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import FingerParameters, ObjectParameters
from slipgrasp.core.scenario.geometry import contact_frame, outline
from slipgrasp.core.scenario.loading import (
    load_scenario,
    scenario_from_mapping,
)

CASE = load_scenario("paper-case-1")
TRIANGLE = ((-0.1, -0.1), (0.12, -0.08), (0.0, 0.15))


def with_outline(corners, faces=("edge-3", "edge-1"), **trajectory):
    mapping = CASE.to_mapping()
    mapping["object"]["corners"] = corners
    mapping["trajectory"].update(trajectory)
    for finger, face in zip(mapping["fingers"], faces, strict=True):
        finger["face"] = face
    return scenario_from_mapping(mapping)


def errors_of(corners, faces=("edge-1", "edge-0")):
    with pytest.raises(ScenarioError) as caught:
        with_outline(corners, faces)
    return caught.value.errors


def finger_on(face, offset=0.0):
    return FingerParameters(base=(0.0, 0.0), face=face, contact_offset=offset)


@pytest.mark.parametrize("edge", range(3))
def test_an_edge_runs_between_its_corners_with_its_normal_into_the_object(edge):
    body, offset = ObjectParameters(corners=TRIANGLE), 0.01
    frame = contact_frame(body, finger_on(f"edge-{edge}", offset))
    anchor, tangent, normal = map(np.array, frame[:3])
    corner, following = outline(body)[[edge, (edge + 1) % 3]]
    np.testing.assert_allclose(anchor + frame.slip_maximum * tangent, corner, atol=1e-15)
    np.testing.assert_allclose(anchor + frame.slip_minimum * tangent, following, atol=1e-15)
    np.testing.assert_allclose(anchor - offset * tangent, (corner + following) / 2, atol=1e-15)
    np.testing.assert_allclose(normal, [tangent[1], -tangent[0]])
    assert math.hypot(*tangent) == pytest.approx(1.0, abs=1e-15)
    assert normal @ anchor < 0.0


def test_fingers_on_edges_have_readable_names():
    rectangle = outline(CASE.object).tolist()
    assert with_outline(rectangle).finger_names == ("edge 3", "edge 1")
    mapping = with_outline(rectangle).to_mapping()
    mapping["fingers"] = [*mapping["fingers"], mapping["fingers"][1]]
    mapping["controller"]["grasp_force"] = "none"
    assert scenario_from_mapping(mapping).finger_names == ("edge 3", "edge 1a", "edge 1b")


@pytest.mark.parametrize(
    ("corners", "field", "words"),
    [
        (TRIANGLE[:2], "object.corners", "at least 3"),
        (TRIANGLE[::-1], "object.corners", "opposite order"),
        ((*TRIANGLE, (-0.09995, -0.0995)), "object.corners.3", "edge-3 is 0.000502"),
        ((*TRIANGLE[:2], (0.0, -0.05), TRIANGLE[2]), "object.corners.2", "corner 2"),
        (((-1, -1), (0, -1), (1, -1), (0, 1)), "object.corners.1", "corner 1"),
        (tuple((x, y + 0.2) for x, y in TRIANGLE), "object.corners", "beyond edge-0"),
    ],
    ids=["two", "clockwise", "short edge", "dent", "straight corner", "centre outside"],
)
def test_what_is_no_convex_polygon_around_its_centre_is_refused(corners, field, words):
    (error,) = errors_of([[float(x), float(y)] for x, y in corners])
    assert error.field == field
    assert words in error.message
    assert error.limit is not None


def test_a_star_is_refused():
    angles = 4.0 * np.pi * np.arange(5) / 5.0
    (error,) = errors_of(np.column_stack((np.cos(angles), np.sin(angles))).tolist())
    assert "star" in error.message


def test_a_face_that_the_object_does_not_have_is_answered_with_those_it_has():
    (error,) = errors_of(TRIANGLE, ("edge-2", "edge-3"))
    assert error.field == "fingers.1.face"
    assert error.limit == "edge-0, edge-1, edge-2"
    (error,) = errors_of(TRIANGLE, ("left", "edge-1"))
    assert (error.field, error.value) == ("fingers.0.face", "left")
    (error,) = errors_of((), ("left", "edge-1"))
    assert error.limit == "left, right, bottom, top"


def test_a_contact_offset_beyond_its_edge_is_refused():
    mapping = with_outline(outline(CASE.object).tolist()).to_mapping()
    mapping["fingers"][0]["contact_offset"] = 0.15
    with pytest.raises(ScenarioError, match=r"beyond the end of the face at 0\.1458 m"):
        scenario_from_mapping(mapping)


def test_a_rectangle_given_by_its_corners_moves_alike_to_the_last_bit():
    expected = simulate(CASE).trace.to_rows()
    polygon = with_outline(outline(CASE.object).tolist())
    np.testing.assert_array_equal(simulate(polygon).trace.to_rows(), expected)


def test_corners_turned_in_an_object_turned_back_move_alike():
    """How the object's own frame lies in it is a matter of description."""
    angle = 0.4
    c, s = math.cos(angle), math.sin(angle)
    corners = outline(CASE.object) @ np.array([[c, s], [-s, c]])
    start = (*CASE.trajectory.start[:2], -angle)
    turned = simulate(with_outline(corners.tolist(), start=start)).trace
    expected = simulate(CASE).trace
    assert turned.object_pose[0, 2] == -angle
    assert len(turned) == len(expected)
    for name in ("slip", "normal_force", "tracking_error", "estimates"):
        one, other = getattr(turned, name), getattr(expected, name)
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-6, err_msg=name)
