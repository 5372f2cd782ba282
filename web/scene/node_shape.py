"""Properties that decide whether the nodes of one scenario can draw another."""

from __future__ import annotations

from slipgrasp.core.scenario import FingerParameters, RailScenario, Scenario, SupportScenario
from slipgrasp.core.scenario.geometry import outline
from slipgrasp.core.scenario.spatial import SpatialFinger
from slipgrasp.scene.parts import rail_ends
from slipgrasp.scene.sizes import sizes_of


def shape_of(scenario: Scenario) -> object:
    """Properties that determine the nodes; equal for runs with other masses or gains."""
    corners = outline(scenario.object).tobytes()
    body = scenario.object.shape, corners, sizes_of(scenario).half_depth
    if isinstance(scenario, SupportScenario):
        return (body, scenario.motion.start, scenario.support.incline)
    if isinstance(scenario, RailScenario):
        f = scenario.finger
        finger = (f.link_lengths, f.base, f.angle, f.elbow)
        return (body, finger, scenario.trajectory.start, rail_ends(scenario))
    fingers = tuple(
        (f.kind, f.link_lengths, f.base, f.face, f.contact_offset, f.elbow, _chain_of(f), _pad(f))
        for f in scenario.fingers
    )
    return (fingers, body, scenario.trajectory.start, scenario.friction_cone == "pyramid")


def _chain_of(finger: FingerParameters | SpatialFinger) -> object:
    """Appearance of a chain."""
    base, attitude, joints, tip = finger.chain
    moves = [(j.kind, j.place, j.attitude, j.axis, j.follows, j.ratio, j.offset) for j in joints]
    return base, attitude, tip, finger.posture, *moves


def _pad(finger: FingerParameters | SpatialFinger) -> object:
    """Appearance of a pad; empty for a planar finger."""
    return isinstance(finger, SpatialFinger) and (finger.pad_radius, finger.pad_pressure)
