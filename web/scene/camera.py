"""A camera that looks at the hand as its picture was laid out, until the user takes it over."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.web.model.page_layout import Picture
from slipgrasp.web.scene.view_plane import FRONT, ViewPlane

FIELD_OF_VIEW = math.radians(10.0)
Place = tuple[float, float, float]

_FREE_SHARE = 0.3
_TOLERANCE = 0.03
_REMEMBERED = 4  # places of the camera, of which a report may still be on its way


@dataclass(frozen=True, slots=True)
class Framing:
    """Where a camera that looks at a plane stands, and what it looks at [m]."""

    centre: tuple[float, float]
    distance: float
    plane: ViewPlane = FRONT

    @property
    def position(self) -> tuple[float, float, float]:
        """The camera in viewer coordinates."""
        return self.plane.place(self.centre, self.distance)

    @property
    def look_at(self) -> tuple[float, float, float]:
        """The middle of the picture in viewer coordinates."""
        return self.plane.place(self.centre)


def frame_box(
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    picture: Picture,
    plane: ViewPlane = FRONT,
) -> Framing:
    """The nearest camera that sees a whole box, above what a panel covers.

    Args:
        low: Lower left corner of the box in the plane [m].
        high: Its upper right corner [m].
        picture: Size of the picture.
        plane: The plane that it looks at.
    """
    height = np.maximum(picture.height, 1)
    free = np.maximum(height - picture.covered, _FREE_SHARE * height)
    half_width, half_height = 0.5 * (high - low)
    half = np.maximum(half_height, half_width * free / np.maximum(picture.width, 1))
    whole = half * height / free
    centre = 0.5 * (low + high)
    middle = (centre[0], centre[1] - (whole - half))
    return Framing(middle, whole / math.tan(0.5 * FIELD_OF_VIEW), plane)


def stands_at(position: Place, framing: Framing) -> bool:
    """Whether a reported camera [m] stands where a framing put it."""
    return _are_near(position, framing.position, framing)


def _are_near(one: Place, other: Place, framing: Framing) -> bool:
    return math.dist(one, other) <= _TOLERANCE * framing.distance


class FrontCamera:
    """Keeps the hand in the picture when the picture changes its size.

    Args:
        camera: The viewer's camera.
    """

    def __init__(self, camera: viser.CameraHandle) -> None:
        self._camera = camera
        self._picture = Picture(camera.image_width, camera.image_height)
        self._framing: Framing | None = None
        self._arrived = False
        self._left: deque[Place] = deque(maxlen=_REMEMBERED)
        self._box: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
        self._plane = FRONT
        self._free = True

    def show(
        self, low: NDArray[np.float64], high: NDArray[np.float64], plane: ViewPlane = FRONT
    ) -> None:
        """Frames a box, the first time and whenever its size changes.

        Args:
            low: Its lower left corner [m].
            high: Its upper right corner [m].
            plane: The plane that it is in.
        """
        same = self._box is not None and np.allclose((low, high), self._box)
        if not same or plane != self._plane:
            self._box, self._plane = (low, high), plane
            self.frame()

    def measure(self, picture: Picture) -> None:
        """Frames again when the picture has changed, unless the user has moved the camera.

        A strip that becomes a little lower, as where a line of the panel no longer wraps, leaves
        the camera where it is: else it would move at every other edit.
        """
        if not self._picture.is_covered_alike(picture):
            self._picture = picture
            if self._free:
                self.frame()

    def report(self, position: Place) -> None:
        """Takes note of where the viewer's camera stands [m].

        Reports from before the camera was framed may still be on their way, even after one that
        it has arrived: only one that has been where it was put, and then is neither there nor
        where it came from, was moved by hand.
        """
        framing = self._framing
        if framing is None:
            return
        in_place = stands_at(position, framing)
        is_late = any(_are_near(position, left, framing) for left in self._left)
        if self._arrived and not in_place and not is_late:
            self._free = False
        self._arrived = self._arrived or in_place

    def frame(self) -> None:
        """Puts the camera in front of the hand."""
        if self._box is None:
            return
        self._free = True
        x, y, z = self._camera.position
        self._left.append((float(x), float(y), float(z)))
        self._framing = frame_box(*self._box, self._picture, self._plane)
        self._arrived = False
        self._camera.fov = FIELD_OF_VIEW
        self._camera.up_direction = (0.0, 0.0, 1.0)
        self._camera.position = self._framing.position
        self._camera.look_at = self._framing.look_at
