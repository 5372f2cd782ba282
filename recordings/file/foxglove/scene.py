"""The parts of a hand, its object and its contacts as Foxglove's 3D panel draws them.

Every entity is fixed to a frame, so that messages contain shapes; only forces, cones, slip and
colours change.
"""

from __future__ import annotations

import math
from functools import cache, singledispatch

import numpy as np
from foxglove_schemas_protobuf.ArrowPrimitive_pb2 import ArrowPrimitive
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.SpherePrimitive_pb2 import SpherePrimitive
from foxglove_schemas_protobuf.TriangleListPrimitive_pb2 import TriangleListPrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.duration_pb2 import Duration

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.space import PLANAR, RAIL, SPATIAL, SUPPORT
from slipgrasp.recordings import palette
from slipgrasp.recordings.file.foxglove.template import Blanks, Template, once
from slipgrasp.scene import parts, primitives, rotations
from slipgrasp.scene.primitives import Role
from slipgrasp.scene.rotations import Values
from slipgrasp.scene.skeleton import Moving
from slipgrasp.scene.states import States

_ORIGIN = np.zeros(3)
_FOR_EVER = Duration()
"""A lifetime until the entity is replaced."""

_COLOURS: dict[Role, palette.Rgb] = {
    Role.DESIRED: palette.GHOST,
    **{role: getattr(palette, role.name) for role in Role if role is not Role.DESIRED},
}
_GLASS = {PLANAR: 1.0, SPATIAL: 0.35, SUPPORT: 1.0, RAIL: 1.0}
"""Opacity of an object and of its cones, which shows forces inside a spatial object."""

_PHASE_COLOURS = np.zeros((1 + max(palette.PHASES) - min(palette.PHASES), 3))
"""Indexed by phase; backward is -1 and therefore the last."""
for _phase, _rgb in palette.PHASES.items():
    _PHASE_COLOURS[_phase] = np.array(_rgb) / 255.0


def scene_template(scenario: Scenario) -> Template:
    """The message that draws hand, object and contacts."""
    blanks = Blanks()
    glass = _GLASS[scenario.space]
    entities = [_entity(blanks, each, glass) for each in parts.entities_of(scenario)]
    return Template(SceneUpdate(entities=entities), blanks)


def _entity(blanks: Blanks, drawn: primitives.Entity, glass: float) -> SceneEntity:
    entity = SceneEntity(
        id=drawn.name,
        frame_id=drawn.frame,
        timestamp=blanks.time(),
        lifetime=_FOR_EVER,
        frame_locked=True,
    )
    for shape in drawn.shapes:
        is_solid = isinstance(shape, primitives.Triangles | primitives.Cone)
        colour = _colour(blanks, shape.paint, glass if is_solid else 1.0)
        _add(shape, entity, blanks, colour)
    return entity


def _colour(blanks: Blanks, paint: primitives.Paint, opacity: float) -> Color:
    if isinstance(paint, Role):
        return _role_colour(paint, opacity)
    red, green, blue = blanks.numbers(lambda states: _PHASE_COLOURS[paint(states)], 3)
    return Color(r=red, g=green, b=blue, a=opacity)


@cache
def _role_colour(role: Role, opacity: float) -> Color:
    """A read-only colour."""
    red, green, blue = (channel / 255.0 for channel in _COLOURS[role])
    return Color(r=red, g=green, b=blue, a=opacity)


@singledispatch
def _add(shape: primitives.Shape, entity: SceneEntity, blanks: Blanks, colour: Color) -> None:
    """Adds a primitive to an entity."""
    raise NotImplementedError(type(shape).__name__)


@_add.register
def _(shape: primitives.Triangles, entity: SceneEntity, blanks: Blanks, colour: Color) -> None:
    solid = TriangleListPrimitive(
        pose=_pose(blanks),
        points=_points(blanks, shape.points, len(shape.points)),
        color=colour,
        indices=shape.indices.ravel().tolist(),
    )
    entity.triangles.append(solid)


@_add.register
def _(shape: primitives.Lines, entity: SceneEntity, blanks: Blanks, colour: Color) -> None:
    lines = LinePrimitive(
        type=LinePrimitive.LINE_LIST,
        pose=_pose(blanks),
        thickness=shape.thickness,
        points=_points(blanks, shape.points, int(shape.indices.max()) + 1),
        color=colour,
        indices=shape.indices.ravel().tolist(),
    )
    entity.lines.append(lines)


@_add.register
def _(shape: primitives.Rod, entity: SceneEntity, blanks: Blanks, colour: Color) -> None:
    along = (shape.end - shape.start).tolist()
    width, length = 2.0 * shape.radii[0], math.hypot(*along)
    cylinder = CylinderPrimitive(
        pose=_pose(blanks, 0.5 * (shape.start + shape.end), rotations.from_z_to(along)),
        size=Vector3(x=width, y=width, z=length),
        bottom_scale=1.0,
        top_scale=shape.radii[1] / shape.radii[0],
        color=colour,
    )
    entity.cylinders.append(cylinder)


@_add.register
def _(shape: primitives.Ball, entity: SceneEntity, blanks: Blanks, colour: Color) -> None:
    width = 2.0 * shape.radius
    size = Vector3(x=width, y=width, z=width)
    entity.spheres.append(
        SpherePrimitive(pose=_pose(blanks, shape.centre), size=size, color=colour)
    )


@_add.register
def _(shape: primitives.Arrow, entity: SceneEntity, blanks: Blanks, colour: Color) -> None:
    vector, head = once(shape.vector), shape.head_length

    def length(states: States) -> Values:
        return np.linalg.norm(vector(states), axis=1)

    arrow = ArrowPrimitive(
        pose=_pose(blanks, shape.tail, lambda states: rotations.from_x_to(vector(states))),
        shaft_length=blanks.number(lambda states: np.maximum(length(states) - head, 0.0)),
        shaft_diameter=shape.shaft_diameter,
        head_length=blanks.number(lambda states: np.minimum(length(states), head)),
        head_diameter=shape.head_diameter,
        color=colour,
    )
    entity.arrows.append(arrow)


@_add.register
def _(shape: primitives.Cone, entity: SceneEntity, blanks: Blanks, colour: Color) -> None:
    def width(states: States) -> Values:
        return 2.0 * shape.slant * np.sin(shape.half_angle(states))

    def height(states: States) -> Values:
        return shape.slant * np.cos(shape.half_angle(states))

    middle = Vector3(z=blanks.number(lambda states: 0.5 * height(states)))
    cone = CylinderPrimitive(
        pose=Pose(position=middle, orientation=Quaternion(w=1.0)),
        size=Vector3(x=blanks.number(width), y=blanks.number(width), z=blanks.number(height)),
        bottom_scale=0.0,
        top_scale=1.0,
        color=colour,
    )
    entity.cylinders.append(cone)


def _points(blanks: Blanks, points: Values | Moving, count: int) -> list[Point3]:
    """Fixed points ``(k, 3)``, or ``count`` moving ones ``(n, count, 3)``."""
    if callable(points):
        width = 3 * count
        numbers = blanks.numbers(lambda states: points(states).reshape(-1, width), width)
    else:
        numbers = points.ravel().tolist()
    return [Point3(x=x, y=y, z=z) for x, y, z in zip(*[iter(numbers)] * 3, strict=True)]


def _pose(
    blanks: Blanks, centre: Values = _ORIGIN, turn: tuple[float, ...] | Moving = rotations.UNTURNED
) -> Pose:
    """A pose with a fixed position in a frame [m], by default its origin."""
    x, y, z = centre.tolist()
    return Pose(position=Vector3(x=x, y=y, z=z), orientation=blanks.quaternion(turn))
