"""Where things are drawn."""

from __future__ import annotations

import math

import numpy as np
import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.hand_files.meshes import Mesh
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.scenario.spatial_geometry import friction_outline
from slipgrasp.recordings.palette import PHASES
from slipgrasp.scene.skeleton import contacts_of
from slipgrasp.web.model.colours import glow
from slipgrasp.web.model.page_layout import Picture
from slipgrasp.web.model.sampling import Sample, Sampler
from slipgrasp.web.scene.boxes import box_around, with_close_ups
from slipgrasp.web.scene.camera import FIELD_OF_VIEW, Framing, frame_box, stands_at
from slipgrasp.web.scene.contact_view import ContactMarks, cone_edge, contact_marks
from slipgrasp.web.scene.layout import (
    FullScale,
    close_up_reach,
    lay_out,
    nice_at_least,
    nice_at_most,
)
from slipgrasp.web.scene.marks import MarkSizes, Trail, sizes_on_hand
from slipgrasp.web.scene.shapes import (
    circle,
    dashed_edges,
    extrude,
    fan,
    rounded_bar,
    turned_profile,
)

SIZES = MarkSizes(0.02, 0.02, 0.1, 0.1, 0.05, 0.005, 0.005, 0.05)
LOW, HIGH = np.array([0.0, 0.0]), np.array([3.0, 2.0])


def marks_of(result: RunResult, sample: Sample, index: int) -> ContactMarks:
    contact = contacts_of(result.scenario)[index]
    return contact_marks(contact, index, sample.states, SIZES, FullScale(30.0, 1.0))


def test_the_trail_leads_from_the_first_touch_to_the_fingertip(case_2: RunResult) -> None:
    sample = Sampler(case_2.trace).at(0.1)
    for index, reached in ((0, 1), (1, 0)):
        backward, forward = Trail(sample.trails[index]).segments
        np.testing.assert_array_equal(backward[1], forward[0])
        ends = (backward[0], forward[1])
        np.testing.assert_allclose(ends[reached], sample.states.slip[0, index])
        np.testing.assert_allclose(ends[1 - reached], 0.0)
        # Along the first axis of the contact frame, against it.
        tip = marks_of(case_2, sample, index).tip
        np.testing.assert_allclose(tip, [-sample.states.slip[0, index, 0], 0.0, 0.0])


def test_the_fingertip_and_its_trail_follow_a_round_object(case_2: RunResult) -> None:
    scenario = with_values(case_2.scenario, {"object.shape": "circle", "object.radius": 0.05})
    sample = Sampler(case_2.trace).at(0.1)
    for index, contact in enumerate(contacts_of(scenario)):
        marks = contact_marks(contact, index, sample.states, SIZES, FullScale(30.0, 1.0))
        angle = sample.states.slip[0, index, 0] / 0.05
        bent = [-0.05 * np.sin(angle), 0.05 * (1.0 - np.cos(angle)), 0.0]
        np.testing.assert_allclose(marks.tip, bent, atol=1e-15)
        trail = Trail(sample.trails[index])
        pieces, colours = trail.divided(24)
        assert len(pieces) == len(colours) == 48
        np.testing.assert_allclose(pieces[1:, 0], pieces[:-1, 1], atol=1e-15)
        points = contact.along_face(pieces) - 0.05 * contact.inward
        np.testing.assert_allclose(np.linalg.norm(points, axis=2), 0.05)
        np.testing.assert_array_equal(trail.divided(1)[0], trail.segments)


def test_the_arrow_of_the_slip_velocity_stands_outside(case_2: RunResult) -> None:
    sample = Sampler(case_2.trace).at(0.1)
    for index, contact in enumerate(contacts_of(case_2.scenario)):
        marks = marks_of(case_2, sample, index)
        assert (marks.motion @ contact.inward < -2.0 * SIZES.tip_radius).all()
        assert np.sign(marks.motion[1, 0] - marks.motion[0, 0]) == -np.sign(
            sample.states.slip_velocity[0, index, 0]
        )


@pytest.mark.parametrize("preset", ["paper-case-2", "spatial-prism"])
def test_a_cone_opens_by_its_friction_and_is_as_long_as_is_asked(preset: str) -> None:
    scenario = load_scenario(preset)
    contact = contacts_of(scenario)[0]
    edge = cone_edge(contact, 0.5, friction_outline(scenario, 48), 0.1)
    np.testing.assert_allclose(np.linalg.norm(edge, axis=1), 0.1)
    inward = edge @ contact.inward
    np.testing.assert_allclose(
        np.linalg.norm(edge - inward[:, None] * contact.inward, axis=1), 0.5 * inward
    )


def test_a_fan_joins_the_edge_of_a_cone_to_its_tip() -> None:
    assert fan(3, closed=True).tolist() == [[0, 1, 2], [0, 2, 3], [0, 3, 1]]
    assert fan(2, closed=False).tolist() == [[0, 1, 2]]


def test_dashes_lie_on_the_lines_that_they_stand_for() -> None:
    ends = np.array([[3.0, 4.0, 1.0], [0.0, -2.0, 0.0]])
    dashes = dashed_edges(np.stack([np.zeros((2, 3)), ends], axis=1), 8)
    assert len(dashes) == 16
    np.testing.assert_allclose(dashes[7, 1], [3.0, 4.0, 1.0])
    np.testing.assert_allclose(dashes[:8, :, 0] * 4.0, dashes[:8, :, 1] * 3.0)


def test_cones_from_both_sides_do_not_meet_inside_the_object() -> None:
    assert sizes_on_hand(0.03).cone_length < 0.03
    assert sizes_on_hand(0.2).cone_length < 0.2


@pytest.mark.parametrize("slip", [3e-5, 0.0021, 0.0473, 0.146])
def test_the_largest_slip_fills_a_close_up_however_long_it_is(slip: float) -> None:
    assert 0.25 < slip / close_up_reach(slip, 0.64) <= 0.64


def test_no_slip_gives_a_finite_close_up() -> None:
    assert close_up_reach(0.0, 0.64) == 2e-5


@pytest.mark.parametrize("value", [0.0013, 0.7, 1.0, 9.9, 123.0])
def test_round_numbers_enclose_a_value(value: float) -> None:
    assert nice_at_most(value) <= value * 1.000001
    assert nice_at_least(value) >= value * 0.999999
    assert nice_at_least(value) / nice_at_most(value) <= 2.0


@pytest.mark.parametrize("count", [2, 3, 4, 5, 6])
def test_close_ups_get_space_above_what_is_held(count: int) -> None:
    (low, high), _ = with_close_ups(LOW, HIGH, count)
    assert (low <= LOW + 1e-12).all()
    assert high[1] > HIGH[1] + 0.3 * (HIGH - LOW)[1]
    if count > 3:
        (_, three), _ = with_close_ups(LOW, HIGH, 3)
        assert high[1] > three[1]


def test_what_close_ups_make_way_for_is_the_object_wherever_it_is(case_2: RunResult) -> None:
    held = lay_out(case_2).held
    low, high = held.min(axis=0), held.max(axis=0)
    path = case_2.trace.object_pose[:, :2]
    # In the world, the plane of a planar hand is upright; a corner is farther than the middle.
    assert (low[[0, 2]] < path.min(axis=0)).all()
    assert (high[[0, 2]] > path.max(axis=0)).all()


def test_the_picture_is_of_what_is_held_until_the_whole_hand_is_wanted(case_2: RunResult) -> None:
    near, far = lay_out(case_2), lay_out(case_2, whole_hand=True)
    bases = np.array([finger.base for finger in case_2.scenario.fingers])
    assert (far.low < bases.min(axis=0)).all()
    assert (near.high[0] < bases[:, 0].max(), near.low[0] > bases[:, 0].min()) == (True, True)
    middle = Picture(724, 900, 185)
    small, large = (frame_box(layout.low, layout.high, middle).distance for layout in (far, near))
    assert small > 3.0 * large


def test_runs_of_one_desired_motion_have_one_picture(case_1: RunResult, case_2: RunResult) -> None:
    usual, lagging = lay_out(case_1), lay_out(case_2)
    np.testing.assert_array_equal(usual.high, lagging.high)


def test_what_falls_far_is_still_in_the_picture() -> None:
    corners, path = np.array([[-0.1, -0.1], [0.1, 0.1]]), np.zeros((3, 2))
    near, far = np.zeros((3, 2)), np.array([[0.0, 0.0], [0.0, 0.14], [np.nan, 9.0]])
    (low, high), (lower, same) = (box_around(corners, path, lag, 0.15) for lag in (near, far))
    assert lower[1] < -0.1 - 0.14 < low[1]
    np.testing.assert_array_equal(high, same)
    hanging = np.array([[0.0, 0.0], [0.0, 0.48]])
    lowest, _ = box_around(corners, path[:2], hanging, 0.15)
    assert lowest[1] < -0.1 - 0.48


@pytest.mark.parametrize("picture", [Picture(730, 900, 200), Picture(400, 700), Picture(2000, 500)])
def test_the_camera_sees_the_whole_box_above_what_a_panel_covers(picture: Picture) -> None:
    framing = frame_box(LOW, HIGH, picture)
    half = framing.distance * math.tan(0.5 * FIELD_OF_VIEW)
    per_pixel = 2.0 * half / picture.height
    assert framing.centre[1] + half >= HIGH[1] - 1e-9
    assert framing.centre[1] - half + picture.covered * per_pixel <= LOW[1] + 1e-9
    assert half * picture.width / picture.height >= 1.5 - 1e-9


def test_a_window_without_height_does_not_break_the_camera() -> None:
    assert math.isfinite(frame_box(LOW, HIGH, Picture(0, 0, 200)).distance)


def test_a_camera_stands_where_it_was_put_within_a_tolerance() -> None:
    framing = Framing((1.5, 1.0), 8.0)
    assert stands_at((1.52, -8.01, 1.0), framing)
    assert not stands_at((4.0, -8.0, 1.0), framing)


@pytest.mark.parametrize("outline", [circle(0.3), circle(0.2, 5)])
def test_slabs_are_closed_and_face_outward(outline: np.ndarray) -> None:
    mesh = extrude(outline, -0.1, 0.1)
    corners = mesh.vertices[mesh.faces].astype(float)
    volume = np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    x, y = outline.T
    area = 0.5 * abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
    assert volume == pytest.approx(0.2 * area, rel=1e-4)


@pytest.mark.parametrize(
    ("bar", "volume"),
    [
        (rounded_bar(1.0, 0.05, 0.02), math.pi * (0.0039 / 3.0 + 2.0 / 3.0 * (0.05**3 + 0.02**3))),
        (
            turned_profile(np.array([[0.0, 0.0], [0.0, 0.1], [1.0, 0.1], [1.0, 0.0]])),
            math.pi * 0.01,
        ),
    ],
)
def test_bars_are_closed_and_face_outward(bar: Mesh, volume: float) -> None:
    corners = bar.vertices[bar.faces].astype(float)
    enclosed = np.linalg.det(corners).sum() / 6.0
    assert enclosed == pytest.approx(volume, rel=0.03)


def test_phases_keep_colours_that_differ_for_colour_blind_people() -> None:
    """Simulated for red and green blindness (Viénot 1999), the colours stay far apart."""
    to_protan = np.array([[0.1124, 0.8876, 0.0], [0.1124, 0.8876, 0.0], [0.004, -0.004, 1.0]])
    to_deutan = np.array([[0.2928, 0.7072, 0.0], [0.2928, 0.7072, 0.0], [-0.0223, 0.0223, 1.0]])
    colours = np.array([glow(colour) for colour in PHASES.values()]) / 255.0
    for simulation in (np.eye(3), to_protan, to_deutan):
        seen = np.clip(colours @ simulation.T, 0.0, 1.0) ** (1 / 2.2)
        for i, j in ((0, 1), (0, 2), (1, 2)):
            assert np.linalg.norm(seen[i] - seen[j]) > 0.3
