"""What a recording's display topics show, as a program that knows only Foxglove reads it."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.trace.trace import Trace
from slipgrasp.recordings.file.foxglove.layouts import DISPLAY_RATE, FrameClock

Matrix = NDArray[np.float64]


class Shown(NamedTuple):
    """One instant as decoded: its time [ns], its frames by name, its entities by id."""

    time: int
    frames: dict[str, Any]
    entities: dict[str, Any]

    def pose(self, frame: str, root: str = "plane") -> Matrix:
        """Where a frame stands in another one above it, as a 4 x 4 matrix."""
        pose = np.eye(4)
        while frame != root:
            transform = self.frames[frame]
            pose = matrix(transform.translation, transform.rotation) @ pose
            frame = transform.parent_frame_id
        return pose

    def place(self, entity: Any, points: Any) -> Matrix:
        """Points of an entity's frame in the model's plane, shape ``(..., 3)``."""
        return placed(self.pose(entity.frame_id), points)


def shown_rows(run: RunResult) -> Trace:
    """The samples that are shown."""
    rows = FrameClock(DISPLAY_RATE).take(run.trace.times)
    return Trace.from_rows(run.trace.shape, run.trace.to_rows()[rows])


def read_topic(path: Path, topic: str) -> list[tuple[Any, Any, Any, Any]]:
    """Schema, channel, record and decoded message of everything on a topic."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return [tuple(found) for found in reader.iter_decoded_messages(topics=[topic])]


def read_shown(path: Path) -> list[Shown]:
    """Everything on both topics, instant by instant."""
    return [
        Shown(
            record.log_time,
            {transform.child_frame_id: transform for transform in told.transforms},
            {entity.id: entity for entity in scene.entities},
        )
        for (_, _, record, told), (_, _, _, scene) in zip(
            read_topic(path, "/tf"), read_topic(path, "/scene"), strict=True
        )
    ]


def matrix(position: Any, rotation: Any) -> Matrix:
    """A decoded position and quaternion as a 4 x 4 matrix."""
    x, y, z, w = rotation.x, rotation.y, rotation.z, rotation.w
    columns = [
        [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)],
        [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)],
        [2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)],
    ]
    pose = np.eye(4)
    pose[:3, :3] = np.array(columns).T
    pose[:3, 3] = (position.x, position.y, position.z)
    return pose


def placed(pose: Matrix, points: Any) -> Matrix:
    """Points in the frame that ``pose`` is given in, shape ``(..., 3)``."""
    return np.asarray(points) @ pose[:3, :3].T + pose[:3, 3]
