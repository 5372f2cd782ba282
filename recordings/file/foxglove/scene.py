"""What hand, object and contacts look like in Foxglove's 3D panel.

Every entity is fixed to a frame of `slipgrasp.recordings.file.foxglove.transforms` and follows it,
so the messages hold shapes; only forces, cones, slip and colours change. Marks of the contacts and
outlines float before the object, towards the eye of who looks at the plane from its front.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from foxglove_schemas_protobuf.ArrowPrimitive_pb2 import ArrowPrimitive
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.TriangleListPrimitive_pb2 import TriangleListPrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from numpy.typing import NDArray

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.geometry import inner_radius, outline
from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings import palette
from slipgrasp.recordings.file.foxglove.shapes import (
    LONGEST_ARROW,
    ball,
    colour,
    finger,
    phase_colour,
    place,
    scene_of,
)
from slipgrasp.recordings.file.foxglove.template import Blanks, Template
from slipgrasp.recordings.file.foxglove.transforms import (
    DESIRED,
    OBJECT,
    contact_frame_name,
    turn,
)


def scene_template(scenario: Scenario) -> Template:
    """The message that draws hand, object and contacts."""
    blanks = Blanks()
    sizes = sizes_of(scenario)
    entities = [_object(scenario, sizes), _desired(scenario, sizes)]
    below = place(0.0, -1.5 * sizes.link_radius)
    for i, each in enumerate(scenario.fingers):
        entities += finger(i, each.link_lengths, sizes.link_radius, sizes.tip_radius, below)
        entities.append(_contact(blanks, sizes, i))
    return scene_of(blanks, entities)


def _object(scenario: Scenario, sizes: Sizes) -> SceneEntity:
    entity = SceneEntity(id="object", frame_id=OBJECT)
    if scenario.object.corners:
        entity.triangles.append(_prism(scenario, sizes))
    else:
        entity.cubes.append(_block(scenario, sizes))
    entity.lines.append(_outline(scenario, sizes, sizes.half_depth, palette.OBJECT_EDGE))
    return entity


def _block(scenario: Scenario, sizes: Sizes) -> CubePrimitive:
    body = scenario.object
    size = Vector3(x=2.0 * body.half_width, y=2.0 * body.face_half_length, z=2.0 * sizes.half_depth)
    return CubePrimitive(pose=place(0.0, 0.0), size=size, color=colour(palette.OBJECT))


def _prism(scenario: Scenario, sizes: Sizes) -> TriangleListPrimitive:
    """The polygon as a slab: its corners behind, then in front, and the triangles between."""
    corners, depth = outline(scenario.object), sizes.half_depth
    points = [Point3(x=x, y=y, z=z) for z in (-depth, depth) for x, y in corners.tolist()]
    count = len(corners)
    indices: list[int] = []
    for k in range(1, count - 1):
        indices += [0, k + 1, k, count, count + k, count + k + 1]
    for k in range(count):
        following = (k + 1) % count
        indices += [k, following, count + following, k, count + following, count + k]
    return TriangleListPrimitive(
        pose=place(0.0, 0.0), points=points, color=colour(palette.OBJECT), indices=indices
    )


def _desired(scenario: Scenario, sizes: Sizes) -> SceneEntity:
    line = _outline(scenario, sizes, sizes.front, palette.GHOST)
    return SceneEntity(id="desired", frame_id=DESIRED, lines=[line])


def _outline(scenario: Scenario, sizes: Sizes, depth: float, rgb: palette.Rgb) -> LinePrimitive:
    corners = outline(scenario.object).tolist()
    return LinePrimitive(
        type=LinePrimitive.LINE_LOOP,
        pose=place(0.0, 0.0),
        thickness=sizes.thickness,
        points=[Point3(x=px, y=py, z=depth) for px, py in corners],
        color=colour(rgb),
    )


def _contact(blanks: Blanks, sizes: Sizes, index: int) -> SceneEntity:
    """Fingertip, force on the object, friction cone and slip trail, in the contact frame."""

    def phase(samples: Trace) -> NDArray[np.int8]:
        return samples.phase[:, index]

    tip = ball(place(0.0, -sizes.tip_radius), sizes.tip_radius, phase_colour(blanks, phase))
    return SceneEntity(
        id=f"contact_{index}",
        frame_id=contact_frame_name(index),
        spheres=[tip],
        arrows=[_force(blanks, sizes, index, phase_colour(blanks, phase))],
        lines=[_cone(blanks, sizes, index), _trail(blanks, sizes, index)],
    )


def _force(blanks: Blanks, sizes: Sizes, index: int, colour: Color) -> ArrowPrimitive:
    """The force of the fingertip on the object, (F_x, F_n) in this frame."""
    head = 0.3 * sizes.mark
    longest = LONGEST_ARROW * sizes.mark

    def angle(samples: Trace) -> NDArray[np.float64]:
        return np.arctan2(samples.normal_force[:, index], samples.tangential_force[:, index])

    def length(samples: Trace) -> NDArray[np.float64]:
        with np.errstate(over="ignore"):
            force = np.hypot(samples.normal_force[:, index], samples.tangential_force[:, index])
            return np.minimum(sizes.per_newton * force, longest)

    return ArrowPrimitive(
        pose=Pose(position=Vector3(z=sizes.front), orientation=turn(blanks, angle)),
        shaft_length=blanks.number(lambda samples: np.maximum(length(samples) - head, 0.0)),
        shaft_diameter=0.1 * sizes.mark,
        head_length=blanks.number(lambda samples: np.minimum(length(samples), head)),
        head_diameter=0.25 * sizes.mark,
        color=colour,
    )


def _cone(blanks: Blanks, sizes: Sizes, index: int) -> LinePrimitive:
    """The edges of the friction cone, (+-mu, 1) in this frame."""

    def across(samples: Trace) -> NDArray[np.float64]:
        return sizes.mark * np.sin(np.arctan(samples.friction_coefficient[:, index]))

    def along(samples: Trace) -> NDArray[np.float64]:
        return sizes.mark * np.cos(np.arctan(samples.friction_coefficient[:, index]))

    left = Point3(x=blanks.number(across), y=blanks.number(along), z=sizes.front)
    right = Point3(
        x=blanks.number(lambda samples: -across(samples)), y=blanks.number(along), z=sizes.front
    )
    return LinePrimitive(
        type=LinePrimitive.LINE_STRIP,
        pose=place(0.0, 0.0),
        thickness=sizes.thickness,
        points=[left, Point3(z=sizes.front), right],
        color=colour(palette.CONE),
    )


def _trail(blanks: Blanks, sizes: Sizes, index: int) -> LinePrimitive:
    """From where the fingertip first touched, which is as far along x as it has slid, to here."""

    def direction(samples: Trace) -> NDArray[np.int8]:
        return np.sign(samples.slip[:, index]).astype(np.int8)

    touched = Point3(x=blanks.number(lambda samples: samples.slip[:, index]), z=sizes.front)
    return LinePrimitive(
        type=LinePrimitive.LINE_STRIP,
        pose=place(0.0, 0.0),
        thickness=2.0 * sizes.thickness,
        points=[touched, Point3(z=sizes.front)],
        color=phase_colour(blanks, direction),
    )


_LINK_RADIUS = 0.05
_LEAST_GRAVITY = 1.0


class Sizes(NamedTuple):
    """Sizes that follow from the scenario [m].

    Attributes:
        half_depth: How far the object reaches towards the eye.
        front: Where marks float, a little nearer to the eye.
        link_radius: Of the links at the start of the first.
        tip_radius: Of the fingertips.
        mark: Length of the edges of a friction cone.
        thickness: Of lines.
        per_newton: Length of an arrow for each newton [m/N].
    """

    half_depth: float
    front: float
    link_radius: float
    tip_radius: float
    mark: float
    thickness: float
    per_newton: float


def sizes_of(scenario: Scenario) -> Sizes:
    """Sizes that suit a hand and object of any scale.

    An arrow as long as half the object is wide stands for twice the object's weight.

    Args:
        scenario: Hand and object.
    """
    body = scenario.object
    unit = inner_radius(body)
    mean_length = float(np.mean([finger.link_lengths for finger in scenario.fingers]))
    weight = body.mass * max(scenario.simulation.gravity, _LEAST_GRAVITY)
    return Sizes(
        half_depth=0.5 * unit,
        front=0.6 * unit,
        link_radius=min(_LINK_RADIUS * mean_length, 0.5 * unit),
        tip_radius=0.22 * unit,
        mark=0.9 * unit,
        thickness=0.05 * unit,
        per_newton=0.5 * unit / weight,
    )
