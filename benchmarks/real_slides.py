"""Real slides: the tosses of a cube published as DAIRLab/contact-nets, reduced to flat slides.

Cite S. Pfrommer, M. Halm, M. Posa, ContactNets, CoRL 2020. The data are not part of this project:
`git clone https://github.com/DAIRLab/contact-nets` has them in ``data/tosses_processed``.
"""

from __future__ import annotations

import pickle
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Floats = NDArray[np.float64]

RATE = 148.0
HALF_WIDTH = 0.0524
"""Half width of the cube, the unit of length of the files [m]."""

STATE_SIZE = 19
"""Position, quaternion (w, x, y, z), velocity, angular velocity, six controls."""

LEAST_SAMPLES = 8
LEAST_SPEED = 0.03  # [m/s]
MOST_TILT = np.radians(2.0)
MOST_HEIGHT = 2e-3  # above a cube that lies flat [m]
MOST_ROLL, MOST_RISE = 0.5, 0.05  # [rad/s], [m/s]

_MOST_NUMBERS = 10_000_000


@dataclass(frozen=True, slots=True, eq=False)
class Slide:
    """A slide of the cube on one of its faces, from sliding until rest or the end of the toss.

    Attributes:
        toss: Number of the toss.
        times: Times of the samples from the first [s].
        position: Position of the centre, shape ``(samples, 2)`` [m].
        yaw: Angle about the vertical, without jumps [rad].
        velocity: Velocity as the authors derived it, shape ``(samples, 2)`` [m/s].
        spin: Angular velocity about the vertical [rad/s].
        rests: Whether it comes to rest.
    """

    toss: int
    times: Floats
    position: Floats
    yaw: Floats
    velocity: Floats
    spin: Floats
    rests: bool


def read_slides(folder: Path) -> list[Slide]:
    """All flat slides in a clone of the repository.

    Raises:
        ValueError: If the folder has no tosses, or a file is not a toss.
    """
    files = sorted(folder.rglob("tosses_processed/*.pt"), key=lambda path: int(path.stem))
    if not files:
        message = f"'{folder}' has no tosses_processed/*.pt; give a clone of DAIRLab/contact-nets"
        raise ValueError(message)
    return [slide for path in files for slide in cut_slides(int(path.stem), read_tensor(path))]


_KNOWN: dict[tuple[str, str], Any] = {
    ("torch._utils", "_rebuild_tensor_v2"): lambda *parts: parts[:4],
    ("torch", "DoubleStorage"): "double",
    ("collections", "OrderedDict"): dict,
}


class _Unpickler(pickle.Unpickler):
    """Reads a tensor without torch, without executing anything named in a file."""

    def find_class(self, module: str, name: str) -> Any:
        """The few names required by a tensor of doubles."""
        if (module, name) not in _KNOWN:
            raise ValueError(f"it names {module}.{name}, which no tensor of doubles does")
        return _KNOWN[module, name]

    def persistent_load(self, pid: Any) -> Any:
        """The description of a storage: its kind, type, key, place and size."""
        return pid


def read_tensor(path: Path) -> Floats:
    """The states of a toss from torch's old format of files, shape ``(samples, 19)``.

    Raises:
        ValueError: If the file is not such a tensor.
    """
    with path.open("rb") as stream:
        try:
            return _read_tensor(stream)
        except (pickle.UnpicklingError, EOFError, TypeError, IndexError, AttributeError) as error:
            raise ValueError(f"'{path.name}' is no tensor: {error}") from error


def _read_tensor(stream: BinaryIO) -> Floats:
    # A magic number, the version of the protocol, and sizes of types come first.
    for _ in range(3):
        _Unpickler(stream).load()
    storage, offset, size, _ = _Unpickler(stream).load()
    keys = _Unpickler(stream).load()
    count = int.from_bytes(stream.read(8), "little")
    wanted = int(np.prod(size))
    if storage[1] != "double" or offset != 0 or len(keys) != 1 or count != wanted:
        raise ValueError("it is not one whole tensor of doubles")
    if count > _MOST_NUMBERS or size[-1] != STATE_SIZE:
        raise ValueError(f"its shape is {tuple(size)}, not (1, samples, {STATE_SIZE})")
    data = stream.read(8 * count)
    if len(data) < 8 * count:
        raise ValueError("its end is missing")
    return np.frombuffer(data, "<f8").reshape(-1, STATE_SIZE)


def cut_slides(toss: int, states: Floats) -> list[Slide]:
    """The flat slides of a toss."""
    lies = _lies_flat(states)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], lies.astype(int), [0]])))
    found = [_slide(toss, states[a:b]) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return [slide for slide in found if slide is not None]


def _lies_flat(states: Floats) -> NDArray[np.bool_]:
    """True if the cube lies on a face and does not roll or rise."""
    axes = np.abs(_rotations(states).inv().apply([0.0, 0.0, 1.0])).max(axis=1)
    height = np.abs(states[:, 2] - 1.0) * HALF_WIDTH
    roll = np.hypot(states[:, 10], states[:, 11])
    rise = np.abs(states[:, 9]) * HALF_WIDTH
    is_level = (axes > np.cos(MOST_TILT)) & (height < MOST_HEIGHT)
    return is_level & (roll < MOST_ROLL) & (rise < MOST_RISE)


def _rotations(states: Floats) -> Rotation:
    return Rotation.from_quat(states[:, 3:7], scalar_first=True)


def _slide(toss: int, states: Floats) -> Slide | None:
    """The slide in a segment of flat states; None if it hardly moves."""
    velocity = states[:, 7:9] * HALF_WIDTH
    moving = np.hypot(*velocity.T) > LEAST_SPEED
    if moving.sum() < LEAST_SAMPLES or not moving[:LEAST_SAMPLES].all():
        return None
    # Its axis is vertical, since the cube lies flat.
    turns = _rotations(states) * _rotations(states[:1]).inv()
    *_, z, w = turns.as_quat().T
    return Slide(
        toss=toss,
        times=np.arange(len(states)) / RATE,
        position=states[:, :2] * HALF_WIDTH,
        yaw=np.unwrap(2.0 * np.arctan2(z, w)),
        velocity=velocity,
        spin=states[:, 12].copy(),
        rests=bool(not moving[-3:].any()),
    )
