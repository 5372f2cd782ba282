"""The frames of hand and object, as Foxglove and Rerun know them.

    world → plane → object → contact_i
                  → desired
                  → finger_i/base → finger_i/link_0 → finger_i/link_1 → finger_i/tip

`world` has z up. `plane` is the model's plane (docs/model.md), upright in it: its x and y
are x and z of the world. `contact_i` is where fingertip i touches, with x along the model's
x_c, in which F_x counts, y along the normal into the object: positive slip is along -x. All
frames but `world` have z out of the plane.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.geometry import contact_frame
from slipgrasp.core.trace.trace import JOINTS_PER_FINGER
from slipgrasp.recordings.file.foxglove.template import Blanks, Column, Template

WORLD = "world"
PLANE = "plane"
OBJECT = "object"
DESIRED = "desired"

_UPRIGHT = Quaternion(x=math.sqrt(0.5), w=math.sqrt(0.5))


def base_frame(finger: int) -> str:
    """The frame at the first joint of a finger."""
    return f"finger_{finger}/base"


def link_frame(finger: int, link: int) -> str:
    """The frame at the start of a link, x along it."""
    return f"finger_{finger}/link_{link}"


def tip_frame(finger: int) -> str:
    """The frame at the end of a finger, x along its last link."""
    return f"finger_{finger}/tip"


def contact_frame_name(contact: int) -> str:
    """The frame on the face where a fingertip touches."""
    return f"contact_{contact}"


def transforms_template(scenario: Scenario) -> Template:
    """The message that places all frames in each other."""
    blanks = Blanks()
    transforms = [
        FrameTransform(
            parent_frame_id=WORLD,
            child_frame_id=PLANE,
            translation=Vector3(),
            rotation=_UPRIGHT,
        ),
        _pose(blanks, PLANE, OBJECT, lambda samples: samples.object_pose),
        _pose(blanks, PLANE, DESIRED, lambda samples: samples.desired_pose),
    ]
    for i in range(len(scenario.fingers)):
        transforms += _finger(blanks, scenario, i)
        transforms.append(_contact(blanks, scenario, i))
    for transform in transforms:
        transform.timestamp.CopyFrom(blanks.time())
    return Template(FrameTransforms(transforms=transforms), blanks)


def turn(blanks: Blanks, angle: Column) -> Quaternion:
    """The rotation about z by an angle [rad]."""
    return Quaternion(
        z=blanks.number(lambda samples: np.sin(0.5 * angle(samples))),
        w=blanks.number(lambda samples: np.cos(0.5 * angle(samples))),
    )


def _pose(blanks: Blanks, parent: str, child: str, pose: Column) -> FrameTransform:
    """A frame at a pose x, y, theta."""
    return FrameTransform(
        parent_frame_id=parent,
        child_frame_id=child,
        translation=Vector3(
            x=blanks.number(lambda samples: pose(samples)[:, 0]),
            y=blanks.number(lambda samples: pose(samples)[:, 1]),
        ),
        rotation=turn(blanks, lambda samples: pose(samples)[:, 2]),
    )


def _finger(blanks: Blanks, scenario: Scenario, index: int) -> Iterator[FrameTransform]:
    """Base, links and tip: every link turns about the end of the one before."""
    finger = scenario.fingers[index]
    x, y = finger.base
    base, tip = base_frame(index), tip_frame(index)
    yield FrameTransform(
        parent_frame_id=PLANE,
        child_frame_id=base,
        translation=Vector3(x=x, y=y),
        rotation=Quaternion(w=1.0),
    )
    parent, reach = base, 0.0
    for k, length in enumerate(finger.link_lengths):
        joint = JOINTS_PER_FINGER * index + k
        yield FrameTransform(
            parent_frame_id=parent,
            child_frame_id=link_frame(index, k),
            translation=Vector3(x=reach),
            rotation=turn(blanks, lambda samples, joint=joint: samples.joint_position[:, joint]),
        )
        parent, reach = link_frame(index, k), length
    yield FrameTransform(
        parent_frame_id=parent,
        child_frame_id=tip,
        translation=Vector3(x=reach),
        rotation=Quaternion(w=1.0),
    )


def _contact(blanks: Blanks, scenario: Scenario, index: int) -> FrameTransform:
    """The contact point p = a + s t, in the frame of the object."""
    frame = contact_frame(scenario.object, scenario.fingers[index])
    (ax, ay), (tx, ty) = frame.anchor, frame.tangent
    half = 0.5 * math.atan2(-ty, -tx)
    return FrameTransform(
        parent_frame_id=OBJECT,
        child_frame_id=contact_frame_name(index),
        translation=Vector3(
            x=blanks.number(lambda samples: ax + tx * samples.slip[:, index]),
            y=blanks.number(lambda samples: ay + ty * samples.slip[:, index]),
        ),
        rotation=Quaternion(z=math.sin(half), w=math.cos(half)),
    )
