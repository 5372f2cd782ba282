"""How round objects and contacts on them are drawn: as the kernel moves them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.curved_faces import slide
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.scene import rotations, skeleton
from slipgrasp.scene.parts import entities_of
from slipgrasp.scene.primitives import Lines, Triangles
from slipgrasp.scene.sizes import sizes_of
from slipgrasp.scene.skeleton import contacts_of, frames_of, world_poses
from slipgrasp.scene.states import states_of

PRESETS = {"circle": "composite-case-2", "cylinder": "spatial-box", "sphere": "spatial-box"}


@pytest.fixture(scope="module", params=PRESETS)
def run(request):
    values = {"object.shape": request.param, "simulation.duration": 0.02}
    return simulate(with_values(load_scenario(PRESETS[request.param]), values))


def solid_of(scenario):
    body, edges = entities_of(scenario)[0].shapes
    assert isinstance(body, Triangles)
    assert isinstance(edges, Lines)
    return body, edges


def test_the_chain_of_joints_ends_where_the_fingertip_touches(run):
    poses = world_poses(frames_of(run.scenario), states_of(run.trace))
    for i in range(len(run.scenario.fingers)):
        tip, contact = poses[skeleton.tip_frame(i)][0], poses[skeleton.contact_name(i)][0]
        assert_allclose(tip, contact, atol=1e-9)


def test_the_frame_of_a_contact_is_that_of_the_surface(run):
    """Its normal points to the axis or the centre, and it turns as the point moves."""
    states = states_of(run.trace)
    radius, d = run.scenario.object.radius, run.scenario.space.num_positions
    slips = np.random.default_rng(1).uniform(-2.0, 2.0, states.slip.shape) * radius
    states = states._replace(slip=slips)
    frames = frames_of(run.scenario)
    poses = world_poses(frames, states)
    centre, turn = poses[skeleton.OBJECT]
    for i in range(len(run.scenario.fingers)):
        place, axes = poses[skeleton.contact_name(i)]
        arm = np.einsum("nji,nj->ni", turn, place - centre)
        normal = np.einsum("nji,nj->ni", turn, axes[:, :, d - 1])
        if run.scenario.object.shape != "sphere":
            arm[:, 2] = 0.0
        assert_allclose(normal, -arm / radius, atol=1e-12)
        assert_allclose(np.linalg.norm(arm, axis=1), radius)


def test_trails_lie_on_the_surface_from_the_first_touch_to_the_fingertip(run):
    states = states_of(run.trace)
    radius = run.scenario.object.radius
    states = states._replace(slip=np.full_like(states.slip, 0.8 * radius))
    poses = world_poses(frames_of(run.scenario), states)
    centre, turn = poses[skeleton.OBJECT]
    front = np.array([0.0, 0.0, sizes_of(run.scenario).front])
    for i, contact in enumerate(contacts_of(run.scenario)):
        entity = next(e for e in entities_of(run.scenario) if e.name == skeleton.contact_name(i))
        trail = [shape for shape in entity.shapes if isinstance(shape, Lines)][-1]
        assert callable(trail.points)
        place, axes = poses[skeleton.contact_name(i)]
        world = place[:, None] + np.einsum("nij,nkj->nki", axes, trail.points(states) - front)
        points = np.einsum("nji,nkj->nki", turn, world - centre[:, None])
        assert_allclose(points[:, 0], np.tile(contact.anchor, (len(points), 1)), atol=1e-12)
        assert_allclose(world[:, -1], place, atol=1e-12)
        across = 3 if run.scenario.object.shape == "sphere" else 2
        assert_allclose(np.linalg.norm(points[:, :, :across], axis=2), radius)


def test_the_solid_is_closed_round_and_seen_from_outside(run):
    body, edges = solid_of(run.scenario)
    corners = body.points[body.indices]
    outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert ((outward * corners.mean(axis=1)).sum(axis=1) > 0.0).all()
    # The volume of the triangles is that of the body, but for the corners of its outline.
    volume = (corners[:, 0] * np.cross(corners[:, 1], corners[:, 2])).sum() / 6.0
    shape, radius = run.scenario.object.shape, run.scenario.object.radius
    depth = sizes_of(run.scenario).half_depth
    whole = 4.0 / 3.0 * radius if shape == "sphere" else 2.0 * depth
    assert volume == pytest.approx(np.pi * radius**2 * whole, rel=0.03)
    pairs = {tuple(sorted(pair)) for pair in edges.indices.tolist()}
    sides = {tuple(sorted(pair)) for k in range(3) for pair in body.indices[:, [k, k - 2]].tolist()}
    assert pairs <= sides


def test_turns_of_a_contact_frame_are_those_of_its_face(run):
    (contact, *_), d = contacts_of(run.scenario), run.scenario.space.num_positions
    slips = np.random.default_rng(2).uniform(-0.3, 0.3, (20, d - 1))
    tangents = -np.eye(3)[: d - 1]
    axes = np.vstack([tangents, contact.inward])
    _, turned = slide(np.zeros(3), axes, contact.curvatures, slips)
    matrices = rotations.matrices(contact.turned(slips))
    assert_allclose(turned, np.einsum("nij,kj->nki", matrices, axes), atol=1e-12)
