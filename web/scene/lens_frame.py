"""What all lenses have in common: the rim, the words around it, and the line to the contact."""

from __future__ import annotations

import math

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.core.words.phrases import length_words
from slipgrasp.recordings.palette import PHASES
from slipgrasp.scene.states import States
from slipgrasp.web.scene import lens_places as places
from slipgrasp.web.scene.detail import Detail, Follower
from slipgrasp.web.scene.images import Pixels, SceneImage, add_image_in_plane, lettering
from slipgrasp.web.scene.layout import SceneLayout
from slipgrasp.web.scene.shapes import circle, polyline
from slipgrasp.web.scene.surfaces import Surfaces

Points = NDArray[np.float64]

_RIM_SEGMENTS = 72
_DIGITS, _WIDEST = 24, 200  # [px]
_FINE_LINE = 0.018
_BEHIND = 0.1


class LensFrame:
    """Draws the rim of a lens in the colour of its phase, a title above, and numbers below.

    Nothing of it lies over what the lens shows.

    Args:
        scene: Where the nodes go.
        name: Name of the node that they are below.
        radius: Radius of the lens [m].
        finger: What the finger is called.
        surfaces: Colours.
        detail: How finely it is drawn.
        turns: Whether it shows by how much the fingertip has turned, as a soft one does.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        radius: float,
        finger: str,
        surfaces: Surfaces,
        detail: Detail,
        *,
        turns: bool = False,
    ) -> None:
        self._scene, self._name, self._surfaces = scene, name, surfaces
        self._turns = turns
        self._radius, self._detail = radius, detail
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
        self._phase: ContactPhase | None = None

    def update(self, states: States, i: int, pale_slip: float | None) -> None:
        """Shows phase, slip and force of a contact at the only one of some states.

        Args:
            states: The state.
            i: Which contact.
            pale_slip: Slip in the run that is drawn pale [m], None without one.
        """
        phase = ContactPhase(int(states.phases[0, i]))
        if phase is not self._phase:
            self._phase = phase
            self._show_phase(phase)
        if self._detail.with_numbers:
            force = math.hypot(*states.tangential_force[0, i], states.normal_force[0, i])
            slip = length_words(float(np.linalg.norm(states.slip[0, i])))
            if self._turns:
                slip += f", {math.degrees(abs(float(states.spin[0, i]))):.0f}°"
            self._tell_numbers(slip, force, pale_slip)

    def _show_phase(self, phase: ContactPhase) -> None:
        slips = phase is not ContactPhase.STICK
        self._rim.colors = np.array(PHASES[phase], dtype=np.uint8)
        for title, visible in zip(self._titles, (not slips, slips), strict=True):
            title.visible = visible

    def tell_scale(self, magnification: float, tick: float) -> None:
        """Shows the magnification of slip, and the length of a tick [m]."""
        text = f"{magnification:g} : 1, ticks {1e3 * tick:g} mm"
        self._add_words("scale", text, places.SCALE_PLACE, places.SCALE_HEIGHT)

    def _tell_numbers(self, slip: str, force: float, pale_slip: float | None) -> None:
        told = [
            f"slip {slip}",
            f"force {force:.1f} N",
            "" if pale_slip is None else f"ghost {length_words(abs(pale_slip))}",
        ]
        for k, line in enumerate(self._lines):
            if told[k] != self._told[k]:
                line.image = self._line(told[k])
        self._told = told

    def _at(self, height: float) -> Points:
        return np.array([0.0, height * self._radius])

    def _add_rim(self) -> viser.LineSegmentsHandle:
        """The ring in the colour of the phase, and a fine one that parts it from the page."""
        for part, radius, thickness, colour, depth in (
            ("bezel", 1.025, 0.07, self._surfaces.joint, 0.03),
            ("rim", 1.0, 0.045, PHASES[ContactPhase.STICK], 0.05),
        ):
            ring = circle(radius * self._radius, _RIM_SEGMENTS)
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
        widest = 2.0 * self._radius * words.shape[0] / words.shape[1]
        image = SceneImage(words, min(height * self._radius, widest))
        return add_image_in_plane(self._scene, f"{self._name}/{name}", image, self._at(place), 0.0)

    def _line(self, text: str) -> Pixels:
        """Numbers on the page, always as wide: only what is on the picture changes."""
        surfaces = self._surfaces
        return lettering(text, surfaces.ink, surfaces.page, size=_DIGITS, width=_WIDEST)

    def _add_line(self, line: int) -> viser.ImageHandle:
        height = places.NUMBERS_HEIGHT * self._radius
        place = self._at(places.NUMBERS_PLACE) - np.array([0.0, (line + 0.5) * height])
        image = SceneImage(self._line(""), height)
        return add_image_in_plane(self._scene, f"{self._name}/numbers{line}", image, place, 0.0)


class Leader:
    """The line from the ring around a contact on the hand to the words below its lens.

    Args:
        scene: Where the node goes.
        name: Its name.
        layout: Where the lenses are.
        index: Which contact.
        surfaces: Colours.
        detail: How finely it is drawn.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        name: str,
        layout: SceneLayout,
        index: int,
        surfaces: Surfaces,
        detail: Detail,
    ) -> None:
        below = np.array([0.0, places.LEADER_PLACE * layout.lens_radius])
        # Behind a planar hand, which it must not cross.
        self._away = -_BEHIND * np.array(layout.plane.towards)
        self._end = np.array(layout.plane.place(layout.lens_centres[index] + below)) + self._away
        thickness = _FINE_LINE * layout.lens_radius
        self._line = scene.add_line_segments(
            name, np.zeros((1, 2, 3)), surfaces.leader, thickness=thickness
        )
        self._follower = Follower(detail, self._draw)
        self._gap = 0.0

    def rescale(self, layout: SceneLayout) -> None:
        """Sets how large the ring is."""
        self._gap = layout.lens_radius / layout.magnification
        self._follower.forget()

    def update(self, spot: Points) -> None:
        """Moves its lower end to a point of the world [m]."""
        self._follower.follow(spot)

    def _draw(self, spot: Points) -> None:
        start = spot + self._away
        towards = (self._end - start) / max(float(np.linalg.norm(self._end - start)), 1e-9)
        ends = np.array([[start + self._gap * towards, self._end]])
        self._line.points = ends.astype(np.float32)
