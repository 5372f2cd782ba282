"""The frames of a hand in space, as Foxglove and Rerun know them.

    world → object → contact_i
          → desired
          → finger_i/base → finger_i/yaw → finger_i/link_0 → finger_i/link_1 → finger_i/tip

`world` and `finger_i/base` have z up; a link lies along x of its frame, and turns about -y.
`contact_i` is where fingertip i touches, with the axes -t_x, -t_y and the normal into the object,
in which F_x, F_y and F_n count: positive slip is along -x and -y.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import spatial_contact
from slipgrasp.core.trace.trace import JOINTS_IN_SPACE, Trace
from slipgrasp.recordings.file.foxglove.template import Blanks, Column, Template, once
from slipgrasp.recordings.file.foxglove.transforms import (
    DESIRED,
    OBJECT,
    WORLD,
    base_frame,
    contact_frame_name,
    link_frame,
    tip_frame,
    turn,
)

Numbers = NDArray[np.float64]


def spatial_transforms_template(scenario: SpatialScenario) -> Template:
    """The message that places all frames in each other."""
    blanks = Blanks()
    transforms = [
        _pose(blanks, OBJECT, lambda samples: samples.object_pose),
        _pose(blanks, DESIRED, once(_desired_pose)),
    ]
    for i in range(len(scenario.fingers)):
        transforms += _finger(blanks, scenario, i)
        transforms.append(_contact(blanks, scenario, i))
    for transform in transforms:
        transform.timestamp.CopyFrom(blanks.time())
    return Template(FrameTransforms(transforms=transforms), blanks)


def _desired_pose(samples: Trace) -> Numbers:
    """Position and quaternion w, x, y, z, shape ``(samples, 7)``: the attitude is exp(e) R."""
    actual = Rotation.from_quat(samples.object_pose[:, 3:], scalar_first=True)
    desired = Rotation.from_rotvec(samples.tracking_error[:, 3:]) * actual
    return np.hstack([samples.desired_pose, desired.as_quat(scalar_first=True)])


def _pose(blanks: Blanks, child: str, pose: Column) -> FrameTransform:
    """A frame in the world."""
    x, y, z, w, qx, qy, qz = (
        blanks.number(lambda samples, k=k: pose(samples)[:, k]) for k in range(7)
    )
    return FrameTransform(
        parent_frame_id=WORLD,
        child_frame_id=child,
        translation=Vector3(x=x, y=y, z=z),
        rotation=Quaternion(w=w, x=qx, y=qy, z=qz),
    )


def _finger(blanks: Blanks, scenario: SpatialScenario, index: int) -> Iterator[FrameTransform]:
    """Base, yaw, links and tip: every link turns about the end of the one before."""
    finger = scenario.fingers[index]
    x, y, z = finger.base
    base, yaw = base_frame(index), f"finger_{index}/yaw"
    yield _fixed(WORLD, base, x, y, z)
    joint = JOINTS_IN_SPACE * index
    yield FrameTransform(
        parent_frame_id=base,
        child_frame_id=yaw,
        translation=Vector3(),
        rotation=turn(blanks, partial(_joint, joint)),
    )
    parent, reach = yaw, 0.0
    for k, length in enumerate(finger.link_lengths):
        yield FrameTransform(
            parent_frame_id=parent,
            child_frame_id=link_frame(index, k),
            translation=Vector3(x=reach),
            rotation=_pitch(blanks, partial(_joint, joint + 1 + k)),
        )
        parent, reach = link_frame(index, k), length
    yield _fixed(parent, tip_frame(index), reach, 0.0, 0.0)


def _pitch(blanks: Blanks, angle: Column) -> Quaternion:
    """The rotation about -y by an angle [rad]: x turns up to z."""
    return Quaternion(
        y=blanks.number(lambda samples: -np.sin(0.5 * angle(samples))),
        w=blanks.number(lambda samples: np.cos(0.5 * angle(samples))),
    )


def _joint(joint: int, samples: Trace) -> Numbers:
    return samples.joint_position[:, joint]


def _fixed(parent: str, child: str, x: float, y: float, z: float) -> FrameTransform:
    return FrameTransform(
        parent_frame_id=parent,
        child_frame_id=child,
        translation=Vector3(x=x, y=y, z=z),
        rotation=Quaternion(w=1.0),
    )


def _contact(blanks: Blanks, scenario: SpatialScenario, index: int) -> FrameTransform:
    """The contact point a + s_x t_x + s_y t_y, in the frame of the object."""
    contact = spatial_contact(scenario.object, scenario.fingers[index])
    along = np.array([contact.tangent_x, contact.tangent_y])
    axes = np.column_stack([*-along, contact.normal])

    def at(samples: Trace, k: int) -> Numbers:
        slip = samples.slip[:, 2 * index : 2 * index + 2]
        return contact.anchor[k] + slip @ along[:, k]

    x, y, z = (blanks.number(partial(at, k=k)) for k in range(3))
    qx, qy, qz, qw = Rotation.from_matrix(axes).as_quat().tolist()
    return FrameTransform(
        parent_frame_id=OBJECT,
        child_frame_id=contact_frame_name(index),
        translation=Vector3(x=x, y=y, z=z),
        rotation=Quaternion(x=qx, y=qy, z=qz, w=qw),
    )
