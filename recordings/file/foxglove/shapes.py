"""Shapes that Foxglove's 3D panel draws, of hands in the plane and in space alike."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.duration_pb2 import Duration
from numpy.typing import NDArray

from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings import palette
from slipgrasp.recordings.file.foxglove.template import Blanks, Template
from slipgrasp.recordings.file.foxglove.transforms import base_frame, link_frame

LONGEST_ARROW = 100.0
"""Longest arrow, as a multiple of the object's size: a run that diverges stays drawable."""

_FOR_EVER = Duration()
"""Until the entity is replaced."""

_ALONG_X = Quaternion(y=math.sqrt(0.5), w=math.sqrt(0.5))
"""Turns the z of a cylinder to x."""

_PHASE_COLOURS = np.zeros((1 + max(palette.PHASES) - min(palette.PHASES), 3))
"""Indexed by phase; backward is -1 and so the last."""
for _phase, _rgb in palette.PHASES.items():
    _PHASE_COLOURS[_phase] = np.array(_rgb) / 255.0

_TAPER = 0.7


def scene_of(blanks: Blanks, entities: Sequence[SceneEntity]) -> Template:
    """The message that draws entities, which follow their frames until they are drawn again."""
    for entity in entities:
        entity.timestamp.CopyFrom(blanks.time())
        entity.lifetime.CopyFrom(_FOR_EVER)
        entity.frame_locked = True
    return Template(SceneUpdate(entities=entities), blanks)


def finger(
    index: int, lengths: Sequence[float], radius: float, tip_radius: float, below: Pose
) -> Iterator[SceneEntity]:
    """The mount, and every link with the joint that it turns about; the last ends at the tip.

    Args:
        index: Of the finger.
        lengths: Of its links [m].
        radius: Of the first link at its start [m].
        tip_radius: Of the fingertip [m].
        below: Where the mount is in the frame of the base.
    """
    mount = CubePrimitive(
        pose=below,
        size=Vector3(x=4.0 * radius, y=2.0 * radius, z=2.0 * radius),
        color=colour(palette.MOUNT),
    )
    yield SceneEntity(id=f"finger_{index}/mount", frame_id=base_frame(index), cubes=[mount])
    for k, length in enumerate(lengths):
        end, reach = _TAPER * radius, length
        if k == len(lengths) - 1:
            end = min(end, tip_radius)
            reach = max(length - tip_radius, 0.5 * length)
        joint = ball(place(0.0, 0.0), 1.1 * radius, colour(palette.JOINT))
        yield SceneEntity(
            id=f"finger_{index}/link_{k}",
            frame_id=link_frame(index, k),
            cylinders=[_bar(reach, radius, end)],
            spheres=[joint],
        )
        radius = end


def _bar(reach: float, radius: float, end_radius: float) -> CylinderPrimitive:
    """A round bar along x that tapers."""
    return CylinderPrimitive(
        pose=Pose(position=Vector3(x=0.5 * reach), orientation=_ALONG_X),
        size=Vector3(x=2.0 * radius, y=2.0 * radius, z=reach),
        bottom_scale=1.0,
        top_scale=end_radius / radius,
        color=colour(palette.LINK),
    )


def ball(pose: Pose, radius: float, paint: Color) -> SpherePrimitive:
    """A sphere."""
    size = Vector3(x=2.0 * radius, y=2.0 * radius, z=2.0 * radius)
    return SpherePrimitive(pose=pose, size=size, color=paint)


def place(x: float, y: float, z: float = 0.0) -> Pose:
    """A place in a frame, not turned [m]."""
    return Pose(position=Vector3(x=x, y=y, z=z), orientation=Quaternion(w=1.0))


def colour(rgb: palette.Rgb, opacity: float = 1.0) -> Color:
    """A colour of the palette."""
    red, green, blue = (channel / 255.0 for channel in rgb)
    return Color(r=red, g=green, b=blue, a=opacity)


def phase_colour(blanks: Blanks, phase: Callable[[Trace], NDArray[np.int8]]) -> Color:
    """The colour of a phase that is looked up for every sample."""
    red, green, blue = (
        blanks.number(lambda samples, k=k: _PHASE_COLOURS[phase(samples), k]) for k in range(3)
    )
    return Color(r=red, g=green, b=blue, a=1.0)
