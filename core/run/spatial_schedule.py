"""Schedules of spatial hands, whose fingertips may cross the edges of round patches."""

from __future__ import annotations

import math
from collections.abc import Sequence

from slipgrasp.core.kernel.spatial.model import Rim, Surface
from slipgrasp.core.run.schedule import EDGE_WIDTH, Timetable
from slipgrasp.core.scenario import Change
from slipgrasp.core.scenario.scenario import is_there
from slipgrasp.core.scenario.spatial import SpatialScenario
from slipgrasp.core.scenario.spatial_geometry import Point, distance_inside, spatial_contact

INSIDE, OUTSIDE = 1.0, -1.0


class SpatialSchedule(Timetable[SpatialScenario]):
    """The segments of a run of a spatial hand; one also ends when a fingertip reaches an edge."""

    def __init__(self, scenario: SpatialScenario) -> None:
        super().__init__(scenario)
        rest = ((0.0, 0.0),) * len(scenario.fingers)
        # For each finger, its side of each patch on its face, by the index of the patch.
        self._sides: list[dict[int, float]] = [{} for _ in rest]
        self._lay_patches(rest, rest)

    def surfaces(self) -> list[Surface]:
        """Friction factors of the fingertips during the current segment."""
        return [self._surface(i, sides) for i, sides in enumerate(self._sides)]

    def pass_instant(self, slips: Sequence[Point], velocities: Sequence[Point]) -> list[Change]:
        """Switches to the next segment.

        Args:
            slips: Slips of the fingertips [m].
            velocities: Their slip velocities [m/s].

        Returns:
            The timed changes at its start.
        """
        due = self.end_stretch()
        self._lay_patches(slips, velocities)
        return due

    def cross_edge(self, contact: int, slips: Sequence[Point], velocities: Sequence[Point]) -> bool:
        """Switches to the segment in which a fingertip has crossed a patch edge.

        All fingertips that cross an edge at this instant are included.

        Args:
            contact: Contact at an edge.
            slips: Slips of the fingertips [m].
            velocities: Their slip velocities [m/s].

        Returns:
            False if the face ends there.
        """
        depths = {k: abs(self._depth(contact, k, slips[contact])) for k in self._sides[contact]}
        nearest = min(depths, key=depths.__getitem__, default=None)
        if nearest is None or self._to_edge(contact, slips[contact]) < depths[nearest]:
            return False
        beyond = -self._sides[contact][nearest]
        for i, (slip, velocity) in enumerate(zip(slips, velocities, strict=True)):
            for k in self._sides[i]:
                if any(velocity) and abs(self._depth(i, k, slip)) <= EDGE_WIDTH:
                    self._sides[i][k] = self._side(i, k, slip, velocity)
        self._sides[contact][nearest] = beyond
        return True

    def _lay_patches(self, slips: Sequence[Point], velocities: Sequence[Point]) -> None:
        """Determines the side of each fingertip for new patches; removes old patches."""
        for i, finger in enumerate(self.present.fingers):
            before = self._sides[i]
            self._sides[i] = {
                k: before[k] if k in before else self._side(i, k, slips[i], velocities[i])
                for k, patch in enumerate(self.present.patches)
                if patch.face == finger.face and is_there(patch, self.begin)
            }

    def _surface(self, i: int, sides: dict[int, float]) -> Surface:
        patches = self.present.patches
        inside = [patches[k].friction_factor for k, side in sides.items() if side == INSIDE]
        rims = (Rim(self._centre(i, k), patches[k].radius, side) for k, side in sides.items())
        # Independent of the order of the patches.
        return Surface(math.prod(sorted(inside)), tuple(rims))

    def _centre(self, i: int, k: int) -> Point:
        """Centre of a patch in slip coordinates of a fingertip on its face [m]."""
        (x, y), (own_x, own_y) = (
            self.present.patches[k].centre,
            self.present.fingers[i].contact_offset,
        )
        return x - own_x, y - own_y

    def _depth(self, i: int, k: int, slip: Point) -> float:
        """Distance of a fingertip from the edge of a patch, positive inside [m]."""
        x, y = self._from_centre(i, k, slip)
        return self.present.patches[k].radius - math.sqrt(x * x + y * y)

    def _from_centre(self, i: int, k: int, slip: Point) -> Point:
        x, y = self._centre(i, k)
        return slip[0] - x, slip[1] - y

    def _side(self, i: int, k: int, slip: Point, velocity: Point) -> float:
        """The side of a patch that a fingertip is on, or slides onto.

        At rest on the edge, the smaller friction applies.
        """
        depth = self._depth(i, k, slip)
        if abs(depth) > EDGE_WIDTH:
            return INSIDE if depth > 0.0 else OUTSIDE
        x, y = self._from_centre(i, k, slip)
        outward = x * velocity[0] + y * velocity[1]
        if outward != 0.0:
            return OUTSIDE if outward > 0.0 else INSIDE
        return INSIDE if self.present.patches[k].friction_factor < 1.0 else OUTSIDE

    def _to_edge(self, i: int, slip: Point) -> float:
        """Distance of a fingertip from the nearest edge of its face [m]."""
        scenario = self.present
        return distance_inside(spatial_contact(scenario.object, scenario.fingers[i]).outline, slip)
