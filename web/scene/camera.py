"""A camera that frames the hand until the user moves it."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.web.model.page_layout import Picture
from slipgrasp.web.scene.boxes import Box
from slipgrasp.web.scene.view_plane import FRONT, ViewPlane

FIELD_OF_VIEW = math.radians(10.0)
Place = tuple[float, float, float]

_FREE_SHARE = 0.3
_CLEARLY = 0.75  # of the distance of the first framing
_TOLERANCE = 0.03
_REMEMBERED = 4  # camera positions that may still be reported


@dataclass(frozen=True, slots=True)
class Framing:
    """Position and target of a camera that looks at a plane [m]."""

    centre: tuple[float, float]
    distance: float
    plane: ViewPlane = FRONT

    @property
    def position(self) -> tuple[float, float, float]:
        """The camera position in viewer coordinates."""
        return self.plane.place(self.centre, self.distance)

    @property
    def look_at(self) -> tuple[float, float, float]:
        """The target in viewer coordinates."""
        return self.plane.place(self.centre)


def frame_box(
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    picture: Picture,
    plane: ViewPlane = FRONT,
) -> Framing:
    """The closest camera that sees a whole box, above the part covered by a panel.

    Args:
        low: Lower left corner of the box in the plane [m].
        high: Its upper right corner [m].
        picture: Size of the view.
        plane: The view plane.
    """
    height = np.maximum(picture.height, 1)
    free = np.maximum(height - picture.covered, _FREE_SHARE * height)
    half_width, half_height = 0.5 * (high - low)
    half = np.maximum(half_height, half_width * free / np.maximum(picture.width, 1))
    whole = half * height / free
    centre = 0.5 * (low + high)
    middle = (centre[0], centre[1] - (whole - half))
    return Framing(middle, whole / math.tan(0.5 * FIELD_OF_VIEW), plane)


def frame_nearest(boxes: Sequence[Box], picture: Picture, plane: ViewPlane = FRONT) -> Framing:
    """The camera that sees the whole first box, or another if that is clearly nearer.

    Args:
        boxes: Lower left and upper right corners in the plane [m].
        picture: Size of the view.
        plane: The view plane.
    """
    first, *others = (frame_box(low, high, picture, plane) for low, high in boxes)
    nearest = min(others, key=lambda framing: framing.distance, default=first)
    return nearest if nearest.distance < _CLEARLY * first.distance else first


OPENING = frame_box(np.array([-0.3, -0.3]), np.array([3.2, 2.4]), Picture(700, 900))
"""The camera of a page before its first run."""


def stands_at(position: Place, framing: Framing) -> bool:
    """Whether a reported camera position [m] is that of a framing."""
    return _are_near(position, framing.position, framing)


def _are_near(one: Place, other: Place, framing: Framing) -> bool:
    return math.dist(one, other) <= _TOLERANCE * framing.distance


class FrontCamera:
    """Keeps the hand in the view when its size changes.

    Args:
        camera: The viewer's camera.
    """

    def __init__(self, camera: viser.CameraHandle) -> None:
        self._camera = camera
        self._picture = Picture(camera.image_width, camera.image_height)
        self._framing: Framing | None = None
        self._arrived = False
        self._left: deque[Place] = deque(maxlen=_REMEMBERED)
        self._boxes: Sequence[Box] = ()
        self._plane = FRONT
        self._free = True
        self._is_held = self._is_due = False

    def hold(self, *, is_held: bool) -> None:
        """Keeps the camera in its place while the mouse drags the object.

        Otherwise the mouse would point elsewhere without having moved. A change that would move
        the camera does so when the drag has ended.
        """
        self._is_held = is_held
        if self._is_due and not is_held:
            self.frame()

    def show(self, boxes: Sequence[Box], plane: ViewPlane = FRONT) -> None:
        """Frames a box, initially and whenever its size changes; see `frame_nearest`.

        Args:
            boxes: Lower left and upper right corners [m].
            plane: The view plane.
        """
        same = len(boxes) == len(self._boxes) and np.allclose(boxes, self._boxes)
        if not same or plane != self._plane:
            self._boxes, self._plane = boxes, plane
            self.frame()

    def measure(self, picture: Picture) -> None:
        """Frames again after a change of the view's size, unless the user has moved the camera.

        If the covered strip becomes slightly lower, for example because a line of the panel no
        longer wraps, the camera stays; otherwise it would move with every other edit.
        """
        if not self._picture.is_covered_alike(picture):
            self._picture = picture
            if self._free:
                self.frame()

    def report(self, position: Place) -> None:
        """Records the position of the viewer's camera [m].

        Reports from before the framing may arrive late, even after one of the new position: only a
        camera that has been at the new position, and is then neither there nor at the old one, was
        moved by the user. A busy page may also put the camera of the opening over the framing.
        """
        framing = self._framing
        if framing is None:
            return
        in_place = stands_at(position, framing)
        if self._free and not in_place and stands_at(position, OPENING):
            self.frame()
            return
        is_late = any(_are_near(position, left, framing) for left in self._left)
        if self._arrived and not in_place and not is_late:
            self._free = False
        self._arrived = self._arrived or in_place

    def frame(self) -> None:
        """Resets the camera to the front."""
        self._is_due = self._is_held
        if not self._boxes or self._is_held:
            return
        self._free = True
        x, y, z = self._camera.position
        self._left.append((float(x), float(y), float(z)))
        self._framing = frame_nearest(self._boxes, self._picture, self._plane)
        self._arrived = False
        self._camera.fov = FIELD_OF_VIEW
        self._camera.up_direction = (0.0, 0.0, 1.0)
        self._camera.position = self._framing.position
        self._camera.look_at = self._framing.look_at
