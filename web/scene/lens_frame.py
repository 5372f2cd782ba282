"""What lenses in the plane and in space have in common: the rim, and the words around it."""

from __future__ import annotations

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.palette import PHASES
from slipgrasp.web.scene import lens_places as places
from slipgrasp.web.scene.images import Pixels, SceneImage, add_image_in_plane, lettering
from slipgrasp.web.scene.shapes import circle, polyline
from slipgrasp.web.scene.surfaces import Surfaces

Points = NDArray[np.float64]

_RIM_SEGMENTS = 72
_LEAST_SHOWN = 0.001  # [mm]
_DIGITS, _ROOM = 24, 200  # [px]


class LensFrame:
    """Draws the rim of a lens in the colour of its phase, a title above, and numbers below.

    Nothing of it lies over what the lens shows.

    Args:
        scene: Where the nodes go.
        name: Name of the node that they are below.
        centre: The middle of the lens in the plane of that node [m].
        radius: Radius of the lens [m].
        finger: What the finger is called.
        surfaces: Colours.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        centre: Points,
        radius: float,
        finger: str,
        surfaces: Surfaces,
    ) -> None:
        self._scene, self._name, self._surfaces = scene, name, surfaces
        self._centre, self._radius = centre, radius
        self._rim = self._add_rim()
        self._titles = [
            self._add_words(
                f"title/{word}",
                f"{finger.capitalize()} {word}",
                places.TITLE_PLACE,
                places.TITLE_HEIGHT,
            )
            for word in ("sticks", "SLIPS")
        ]
        self._lines = [self._add_line(line) for line in range(places.NUMBER_LINES)]
        self._told = [""] * places.NUMBER_LINES

    def show_phase(self, phase: ContactPhase) -> None:
        """Tells what the fingertip does."""
        slips = phase is not ContactPhase.STICK
        self._rim.colors = np.array(PHASES[phase], dtype=np.uint8)
        for title, visible in zip(self._titles, (not slips, slips), strict=True):
            title.visible = visible

    def tell_scale(self, magnification: float, tick: float) -> None:
        """Tells how much larger than life the lens shows slip, and what a tick stands for [m]."""
        text = f"{magnification:g} : 1, ticks {1e3 * tick:g} mm"
        self._add_words("scale", text, places.SCALE_PLACE, places.SCALE_HEIGHT)

    def tell_numbers(self, slip: float, force: float, pale_slip: float | None = None) -> None:
        """Tells slip [m] and force [N], and the slip of the pale run, if it has one."""
        told = [
            f"slip {_millimetres(slip)}",
            f"force {force:.1f} N",
            "" if pale_slip is None else f"pale {_millimetres(pale_slip)}",
        ]
        for k, line in enumerate(self._lines):
            if told[k] != self._told[k]:
                line.image = self._line(told[k])
        self._told = told

    def _at(self, height: float) -> Points:
        return self._centre + np.array([0.0, height * self._radius])

    def _add_rim(self) -> viser.LineSegmentsHandle:
        """The ring in the colour of the phase, and a fine one that parts it from the page."""
        for part, radius, thickness, colour, depth in (
            ("bezel", 1.025, 0.07, self._surfaces.joint, 0.03),
            ("rim", 1.0, 0.045, PHASES[ContactPhase.STICK], 0.05),
        ):
            ring = self._centre + circle(radius * self._radius, _RIM_SEGMENTS)
            added = self._scene.add_line_segments(
                f"{self._name}/{part}",
                polyline(ring, depth, closed=True),
                colour,
                thickness=thickness * self._radius,
            )
        return added

    def _add_words(self, name: str, text: str, place: float, height: float) -> viser.ImageHandle:
        """Words on the page, small enough for the width of the lens."""
        words = lettering(text, self._surfaces.ink, self._surfaces.page)
        room = 2.0 * self._radius * words.shape[0] / words.shape[1]
        image = SceneImage(words, min(height * self._radius, room))
        return add_image_in_plane(self._scene, f"{self._name}/{name}", image, self._at(place), 0.0)

    def _line(self, text: str) -> Pixels:
        """Numbers on the page, always as wide: only what is on the picture changes."""
        surfaces = self._surfaces
        return lettering(text, surfaces.ink, surfaces.page, size=_DIGITS, width=_ROOM)

    def _add_line(self, line: int) -> viser.ImageHandle:
        height = places.NUMBERS_HEIGHT * self._radius
        place = self._at(places.NUMBERS_PLACE) - np.array([0.0, (line + 0.5) * height])
        image = SceneImage(self._line(""), height)
        return add_image_in_plane(self._scene, f"{self._name}/numbers{line}", image, place, 0.0)


def _millimetres(slip: float) -> str:
    length = 1e3 * abs(slip)
    digits = ".2g" if _LEAST_SHOWN <= length < 1.0 else ".1f"
    return f"{length:{digits}} mm"
