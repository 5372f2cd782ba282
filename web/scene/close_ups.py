"""Data of the close-ups: one packet of arrays for each run.

The page draws a close-up of every contact over the view (`web/page/overlay.js`). A packet contains
the data for all instants, so that nothing else is sent during playback. It is sent with the nodes
of the scene, as the points of an invisible node, so that the page applies both together, and a
recorded scene contains it.
"""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import FingerParameters, PlanarScenario, Scenario
from slipgrasp.core.scenario.spatial_geometry import friction_outline
from slipgrasp.core.trace.trace import Trace
from slipgrasp.scene.patches import FacePatch, patches_on
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.sizes import sizes_of
from slipgrasp.scene.skeleton import Contact, contacts_of
from slipgrasp.server.viewer.server import release_arrays
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.scene.layout import SceneLayout
from slipgrasp.web.scene.marks import beliefs_of

Arrays = dict[str, NDArray[Any]]

PACKET, CLOCK = "/close-ups", "/clock"
"""Nodes of the scene: the points of one are the packet, the position of the other is the time."""

_MOST_ROWS = 4000
_OUTLINE_CORNERS = 48
_ALIGNED, _POINT = 8, 12  # bytes


class CloseUps:
    """Sends the data of the close-ups to the page.

    Args:
        scene: Scene of the nodes.
    """

    def __init__(self, scene: viser.SceneApi) -> None:
        self._packet = scene.add_point_cloud(
            PACKET, np.zeros((1, 3), np.float32), (0, 0, 0), precision="float32", visible=False
        )
        self._clock = scene.add_frame(CLOCK, show_axes=False)

    def show(self, facts: dict[str, Any], arrays: Arrays) -> None:
        """Sends another run, see `facts_of` and `arrays_of`."""
        packet = packed(facts, arrays)
        padding = b"\0" * (-len(packet) % _POINT)
        self._packet.points = np.frombuffer(packet + padding, np.float32).reshape(-1, 3)
        release_arrays(self._packet)

    def move(self, time: float) -> None:
        """Shows an instant of the run [s]."""
        self._clock.position = (time, 0.0, 0.0)


def facts_of(
    result: RunResult,
    ghost: RunResult | None,
    layout: SceneLayout,
    appearance: Appearance,
    object_node: str,
) -> dict[str, Any]:
    """Constant data of a run.

    Args:
        result: The run.
        ghost: The ghost, if any.
        layout: The scales.
        appearance: Display options.
        object_node: Node that moves with the object.
    """
    scenario = result.scenario
    own = contacts_of(scenario) if scenario.space.has_hand else ()
    pale = () if ghost is None else contacts_of(ghost.scenario)
    return {
        "visible": appearance.lenses and len(own) > 0,
        "cones": appearance.cones,
        "skipsChanges": _skips_changes(result.trace),
        "object": object_node,
        "reach": layout.reach,
        "tick": layout.tick,
        "force": layout.full.force / appearance.force_scale,
        "speed": layout.full.speed,
        "limit": layout.limit,
        "outline": friction_outline(scenario, _OUTLINE_CORNERS).tolist(),
        "contacts": [_contact_facts(scenario, i, each, pale) for i, each in enumerate(own)],
    }


def arrays_of(result: RunResult, ghost: RunResult | None, layout: SceneLayout) -> Arrays:
    """Variable data of a run, with a row for each stored sample if there are not too many.

    Args:
        result: The run.
        ghost: The ghost, if any.
        layout: Points around the object.
    """
    trace, rows = result.trace, _rows_to_send(result.trace)
    count = trace.shape.num_contacts

    def split(values: Values) -> NDArray[np.float32]:
        return values[rows].reshape(len(rows), count, -1).astype(np.float32)

    estimates = [
        np.full(len(rows), np.nan) if place is None else trace.estimates[rows, place]
        for place in beliefs_of(result)
    ]
    arrays: Arrays = {
        "times": trace.times[rows],
        "slip": split(trace.slip),
        "velocity": split(trace.slip_velocity),
        "tangential": split(trace.tangential_force),
        "normal": split(trace.normal_force),
        "friction": split(trace.friction_coefficient),
        "estimate": np.stack(estimates, axis=1).astype(np.float32),
        "phase": trace.phase[rows].astype(np.int8),
        "held": layout.held.astype(np.float32),
    }
    if trace.shape.space.has_pads and trace.spin.shape[1]:
        arrays |= {"spin": split(trace.spin), "moment": split(trace.torsional_moment)}
    if isinstance(result.scenario, PlanarScenario):
        joints = trace.joint_position[rows].reshape(len(rows), count, -1)
        links = [link_angles(each, joints[:, i]) for i, each in enumerate(result.scenario.fingers)]
        turned = np.stack(links, axis=1) - trace.object_pose[rows, 2:3]
        arrays["link"] = turned.astype(np.float32)
    if ghost is not None:
        of_ghost = _rows_to_send(ghost.trace)
        slip = ghost.trace.slip[of_ghost].reshape(len(of_ghost), len(ghost.scenario.fingers), -1)
        arrays["ghostTimes"] = ghost.trace.times[of_ghost]
        arrays["ghostSlip"] = slip.astype(np.float32)
    return arrays


def link_angles(finger: FingerParameters, joints: Values) -> Values:
    """Directions of the last link of a planar finger, ``(n,)`` [rad].

    Args:
        finger: The finger.
        joints: Its joint positions, ``(n, 2)`` [rad, m].
    """
    if finger.kind != "chain":
        return joints.sum(axis=1)
    turns = [float(joint.kind == "revolute") for joint in finger.joints]
    x, y = finger.tip if any(finger.tip) else finger.joints[-1].axis
    fixed = finger.attitude + sum(joint.attitude for joint in finger.joints) + math.atan2(y, x)
    return (joints * np.array(turns)).sum(axis=1) + fixed


def packed(facts: dict[str, Any], arrays: Arrays) -> bytes:
    """Facts and arrays as bytes: length of the JSON, JSON, arrays; each aligned.

    Args:
        facts: Constant data for JSON.
        arrays: Contiguous arrays; the JSON lists their names, types and shapes.
    """
    listed = [[name, array.dtype.str[1:], array.shape] for name, array in arrays.items()]
    head = json.dumps({**facts, "arrays": listed}).encode()
    pieces = [np.uint64(len(head)).tobytes(), head, *(each.tobytes() for each in arrays.values())]
    return b"".join(piece + b"\0" * (-len(piece) % _ALIGNED) for piece in pieces)


def _rows_to_send(trace: Trace) -> NDArray[np.intp]:
    """All rows if there are few; otherwise evenly spaced ones and those with phase changes."""
    count = len(trace)
    if count <= _MOST_ROWS:
        return np.arange(count)
    evenly = np.linspace(0, count - 1, _MOST_ROWS).astype(np.intp)
    if _skips_changes(trace):
        return evenly
    changes = _rows_before_changes(trace)
    return np.unique(np.concatenate([evenly, changes, changes + 1]))


def _skips_changes(trace: Trace) -> bool:
    """Whether there are too many phase changes to send all."""
    return len(trace) > _MOST_ROWS and len(_rows_before_changes(trace)) > _MOST_ROWS


def _rows_before_changes(trace: Trace) -> NDArray[np.intp]:
    return np.flatnonzero((np.diff(trace.phase, axis=0) != 0).any(axis=1))


def _contact_facts(
    scenario: Scenario, i: int, contact: Contact, pale: tuple[Contact, ...]
) -> dict[str, Any]:
    """Position of a contact on the object, and its directions in a planar close-up."""
    pad, front = contact.pad, np.array([0.0, 0.0, sizes_of(scenario).front])
    return {
        "anchor": (contact.anchor + front).tolist(),
        "flat": contact.dimensions == 2,
        "tangent": (-contact.axes[:2, 0]).tolist(),
        "inward": contact.axes[:2, 1].tolist(),
        "onSlides": contact.on_slides,
        "pad": 0.0 if pad is None else pad.radius,
        "eccentricity": 0.0 if pad is None else pad.eccentricity,
        "name": scenario.finger_names[i],
        "ghost": i < len(pale) and np.allclose(pale[i].axes, contact.axes),
        "patches": [_patch_facts(each) for each in patches_on(scenario, i)],
    }


def _patch_facts(each: FacePatch) -> dict[str, Any]:
    start, end = each.patch.start_time, each.patch.end_time
    return {"start": start, "end": end, "centre": each.centre, "radius": each.radius}
