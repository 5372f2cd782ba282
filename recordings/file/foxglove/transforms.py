"""The frames of hand and object as messages for Foxglove and Rerun."""

from __future__ import annotations

from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms

from slipgrasp.core.scenario import Scenario
from slipgrasp.recordings.file.foxglove.template import Blanks, Template
from slipgrasp.scene.skeleton import Frame, frames_of


def transforms_template(scenario: Scenario) -> Template:
    """The message with the poses of all frames."""
    blanks = Blanks()
    transforms = [_transform(blanks, frame) for frame in frames_of(scenario)]
    return Template(FrameTransforms(transforms=transforms), blanks)


def _transform(blanks: Blanks, frame: Frame) -> FrameTransform:
    return FrameTransform(
        timestamp=blanks.time(),
        parent_frame_id=frame.parent,
        child_frame_id=frame.name,
        translation=blanks.vector(frame.position),
        rotation=blanks.quaternion(frame.rotation),
    )
