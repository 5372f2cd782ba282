"""Where the dashboard draws the meshes of a hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from slipgrasp.core.scenario.hand_files.description import ImportedFinger
from slipgrasp.core.scenario.hand_files.meshes import HandMeshes
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.scene import skeleton
from slipgrasp.scene.states import States

Points = NDArray[np.float64]


def drawn_vertices(
    fingers: Sequence[ImportedFinger], meshes: HandMeshes, positions: Points
) -> Points:
    """All vertices of base and links, in the frame of the base, ``(n, 3)`` [m].

    Args:
        fingers: The fingers.
        meshes: Their meshes.
        positions: Positions of the independent joints, ``(fingers, 3)`` [rad, m].
    """
    scenario = load_scenario("trifinger")
    assert isinstance(scenario, SpatialScenario)
    at_origin = replace(scenario.fingers[0], base=(0.0, 0.0, 0.0), attitude=(1.0, 0.0, 0.0, 0.0))
    # With one finger more, because a scenario has at least two; it has no meshes.
    hand = tuple(
        replace(at_origin, joints=each.joints, tip=each.tip) for each in (*fingers, fingers[0])
    )
    positions = np.concatenate([positions, positions[:1]])
    frames = [
        frame
        for frame in skeleton.frames_of(replace(scenario, fingers=hand))
        if skeleton.finger_of(frame.name) is not None
    ]
    nothing = dict.fromkeys(States._fields, np.zeros(1))
    states = States(**nothing | {"joint_positions": positions[None]})
    poses = skeleton.world_poses(frames, states)
    vertices = [meshes.base.vertices]
    for i, links in enumerate(meshes.links):
        for k, mesh in enumerate(links):
            (origin,), (turn,) = poses[skeleton.link_frame(i, k)]
            vertices.append(mesh.vertices @ turn.T + origin)
    return np.concatenate(vertices)


def assert_same_points(ours: Points, theirs: Points) -> None:
    """Each point of one set is at one of the other, up to 1 nm."""
    for a, b in ((ours, theirs), (theirs, ours)):
        assert len(a) > 0 and KDTree(a).query(b)[0].max() < 1e-9
