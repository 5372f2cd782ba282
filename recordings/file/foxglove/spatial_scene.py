"""What a hand in space, its object and its contacts look like in Foxglove's 3D panel.

As in the plane every entity follows a frame, here of
`slipgrasp.recordings.file.foxglove.spatial_transforms`. One sees into the object, where forces and
cones are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from foxglove_schemas_protobuf.ArrowPrimitive_pb2 import ArrowPrimitive
from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CylinderPrimitive_pb2 import CylinderPrimitive
from foxglove_schemas_protobuf.LinePrimitive_pb2 import LinePrimitive
from foxglove_schemas_protobuf.Point3_pb2 import Point3
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.TriangleListPrimitive_pb2 import TriangleListPrimitive
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from numpy.typing import NDArray

from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import base_corners, edges_of
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
from slipgrasp.recordings.file.foxglove.template import Blanks, Template, once
from slipgrasp.recordings.file.foxglove.transforms import DESIRED, OBJECT, contact_frame_name

Numbers = NDArray[np.float64]

_GLASS = 0.35
_LINK_RADIUS = 0.04
_LEAST_GRAVITY = 1.0


class _Sizes(NamedTuple):
    """Sizes that follow from the scenario [m]; `per_newton` is of arrows [m/N]."""

    link_radius: float
    tip_radius: float
    mark: float
    thickness: float
    per_newton: float


def spatial_scene_template(scenario: SpatialScenario) -> Template:
    """The message that draws hand, object and contacts."""
    blanks, sizes = Blanks(), _sizes_of(scenario)
    entities = [
        SceneEntity(
            id="object",
            frame_id=OBJECT,
            triangles=[_prism(scenario)],
            lines=[_edges(scenario, sizes, palette.OBJECT_EDGE)],
        ),
        SceneEntity(id="desired", frame_id=DESIRED, lines=[_edges(scenario, sizes, palette.GHOST)]),
    ]
    below = place(0.0, 0.0, -2.0 * sizes.link_radius)
    for i, each in enumerate(scenario.fingers):
        entities += finger(i, each.link_lengths, sizes.link_radius, sizes.tip_radius, below)
        entities.append(_contact(blanks, scenario, sizes, i))
    return scene_of(blanks, entities)


def _corners(scenario: SpatialScenario) -> list[Point3]:
    """Corners of the base, then those above them."""
    half = 0.5 * scenario.object.height
    return [Point3(x=x, y=y, z=z) for z in (-half, half) for x, y in base_corners(scenario.object)]


def _prism(scenario: SpatialScenario) -> TriangleListPrimitive:
    points = _corners(scenario)
    count = len(points) // 2
    indices: list[int] = []
    for k in range(1, count - 1):
        indices += [0, k + 1, k, count, count + k, count + k + 1]
    for k in range(count):
        following = (k + 1) % count
        indices += [k, following, count + following, k, count + following, count + k]
    return TriangleListPrimitive(
        pose=place(0.0, 0.0),
        points=points,
        color=colour(palette.OBJECT, _GLASS),
        indices=indices,
    )


def _edges(scenario: SpatialScenario, sizes: _Sizes, rgb: palette.Rgb) -> LinePrimitive:
    points = _corners(scenario)
    count = len(points) // 2
    indices: list[int] = []
    for k in range(count):
        following = (k + 1) % count
        indices += [k, following, count + k, count + following, k, count + k]
    return LinePrimitive(
        type=LinePrimitive.LINE_LIST,
        pose=place(0.0, 0.0),
        thickness=sizes.thickness,
        points=points,
        color=colour(rgb),
        indices=indices,
    )


def _contact(blanks: Blanks, scenario: SpatialScenario, sizes: _Sizes, i: int) -> SceneEntity:
    """Fingertip, force on the object, friction cone or pyramid, and where it first touched."""

    def phase(samples: Trace) -> NDArray[np.int8]:
        return samples.phase[:, i]

    tip = place(0.0, 0.0, -sizes.tip_radius)
    entity = SceneEntity(
        id=f"contact_{i}",
        frame_id=contact_frame_name(i),
        spheres=[ball(tip, sizes.tip_radius, phase_colour(blanks, phase))],
        arrows=[_force(blanks, sizes, i, phase_colour(blanks, phase))],
        lines=[_trail(blanks, sizes, i)],
    )
    if scenario.has_pyramid:
        entity.lines.append(_pyramid(blanks, sizes, i))
    else:
        entity.cylinders.append(_cone(blanks, sizes, i))
    return entity


def _force(blanks: Blanks, sizes: _Sizes, index: int, paint: Color) -> ArrowPrimitive:
    """The force of the fingertip on the object, (F_x, F_y, F_n) in this frame."""
    head, longest = 0.3 * sizes.mark, LONGEST_ARROW * sizes.mark

    def force(samples: Trace) -> Numbers:
        across = samples.tangential_force[:, 2 * index : 2 * index + 2]
        return np.column_stack([across, samples.normal_force[:, index]])

    def length(samples: Trace) -> Numbers:
        with np.errstate(over="ignore"):
            size = np.linalg.norm(force(samples), axis=1)
            return np.minimum(sizes.per_newton * size, longest)

    def turning(samples: Trace) -> Numbers:
        """The shortest rotation of x to the force, quaternion w, x, y, z."""
        vectors = force(samples)
        largest = np.maximum(np.abs(vectors).max(axis=1, keepdims=True), 1e-300)
        unit = vectors / largest
        unit = unit / np.maximum(np.linalg.norm(unit, axis=1, keepdims=True), 1e-300)
        halfway = np.column_stack([1.0 + unit[:, 0], 0.0 * unit[:, 0], -unit[:, 2], unit[:, 1]])
        return halfway / np.linalg.norm(halfway, axis=1, keepdims=True)

    turned = once(turning)
    w, x, y, z = (blanks.number(lambda samples, k=k: turned(samples)[:, k]) for k in range(4))
    return ArrowPrimitive(
        pose=Pose(position=Vector3(), orientation=Quaternion(w=w, x=x, y=y, z=z)),
        shaft_length=blanks.number(lambda samples: np.maximum(length(samples) - head, 0.0)),
        shaft_diameter=0.08 * sizes.mark,
        head_length=blanks.number(lambda samples: np.minimum(length(samples), head)),
        head_diameter=0.2 * sizes.mark,
        color=paint,
    )


def _cone(blanks: Blanks, sizes: _Sizes, index: int) -> CylinderPrimitive:
    """The friction cone, from its apex at the contact into the object."""

    def angle(samples: Trace) -> Numbers:
        return np.arctan(samples.friction_coefficient[:, index])

    def width(samples: Trace) -> Numbers:
        return 2.0 * sizes.mark * np.sin(angle(samples))

    def height(samples: Trace) -> Numbers:
        return sizes.mark * np.cos(angle(samples))

    middle = Vector3(z=blanks.number(lambda samples: 0.5 * height(samples)))
    return CylinderPrimitive(
        pose=Pose(position=middle, orientation=Quaternion(w=1.0)),
        size=Vector3(x=blanks.number(width), y=blanks.number(width), z=blanks.number(height)),
        bottom_scale=0.0,
        top_scale=1.0,
        color=colour(palette.CONE, _GLASS),
    )


def _pyramid(blanks: Blanks, sizes: _Sizes, index: int) -> LinePrimitive:
    """The edges of the friction pyramid, (+-mu, +-mu, 1) in this frame, and around their ends."""

    def along(samples: Trace) -> Numbers:
        friction = samples.friction_coefficient[:, index]
        return sizes.mark / np.sqrt(1.0 + 2.0 * friction * friction)

    def end(first: float, second: float) -> Point3:
        x, y = (
            blanks.number(
                lambda samples, sign=sign: (
                    sign * samples.friction_coefficient[:, index] * along(samples)
                )
            )
            for sign in (first, second)
        )
        return Point3(x=x, y=y, z=blanks.number(along))

    ends = [end(1.0, 1.0), end(-1.0, 1.0), end(-1.0, -1.0), end(1.0, -1.0)]
    return LinePrimitive(
        type=LinePrimitive.LINE_LIST,
        pose=place(0.0, 0.0),
        thickness=sizes.thickness,
        points=[Point3(), *ends],
        color=colour(palette.CONE),
        indices=[0, 1, 0, 2, 0, 3, 0, 4, 1, 2, 2, 3, 3, 4, 4, 1],
    )


def _trail(blanks: Blanks, sizes: _Sizes, index: int) -> LinePrimitive:
    """Straight from where the fingertip first touched, as far along x and y as it slid, to here."""
    x, y = (blanks.number(lambda samples, k=k: samples.slip[:, 2 * index + k]) for k in range(2))
    return LinePrimitive(
        type=LinePrimitive.LINE_STRIP,
        pose=place(0.0, 0.0),
        thickness=2.0 * sizes.thickness,
        points=[Point3(x=x, y=y), Point3()],
        color=colour(palette.SHADE),
    )


def _sizes_of(scenario: SpatialScenario) -> _Sizes:
    """Sizes that suit a hand and object of any scale.

    An arrow as long as half the object is wide stands for twice the object's weight.
    """
    body = scenario.object
    unit = min(0.5 * body.height, *(edge[2] for edge in edges_of(base_corners(body))))
    mean_length = float(np.mean([each.link_lengths for each in scenario.fingers]))
    weight = body.mass * max(scenario.simulation.gravity, _LEAST_GRAVITY)
    return _Sizes(
        link_radius=min(_LINK_RADIUS * mean_length, 0.5 * unit),
        tip_radius=0.15 * unit,
        mark=0.9 * unit,
        thickness=0.04 * unit,
        per_newton=0.5 * unit / weight,
    )
