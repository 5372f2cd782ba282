"""Pulses and patches: which load acts, and which friction every contact has, when and where.

A contact is on a patch where it is beyond one of its edges and not beyond the other. On which
side of every edge it is stays fixed between two events, so that each phase is smooth.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario import Patch, Scenario
from tests.references.closed_loop import ClosedLoop
from tests.references.hybrid import Guard, unpack

Array = NDArray[np.float64]
Edge = tuple[int, int, float]  # contact, patch, slip at which it reaches the edge
Sides = dict[Edge, int]

ON_EDGE = 1e-11  # slip from an edge at which the velocity tells the side [m]


class World(NamedTuple):
    """What happens to a hand from outside."""

    scenario: Scenario
    plain: ClosedLoop

    @classmethod
    def from_scenario(cls, scenario: Scenario) -> World:
        """Reads a scenario; timed changes are not part of the reference."""
        return cls(scenario, ClosedLoop.from_scenario(scenario))

    def instants(self) -> Iterator[float]:
        """When something begins or ends."""
        for pulse in self.scenario.pulses:
            yield from (pulse.time, pulse.time + pulse.duration)
        for patch in self.scenario.patches:
            yield from (patch.start_time, np.inf if patch.end_time is None else patch.end_time)

    def sides(self, t: float, z: Array) -> Sides:
        """On which side of every edge each contact is at a time, -1 below or +1 above.

        0 where it rests on the edge.
        """
        state, _ = unpack(self.plain, z)
        found = {}
        for i, k, edge in self._edges(t):
            distance = state.slip[i] - edge
            decisive = state.slip_velocity[i] if abs(distance) < ON_EDGE else distance
            found[i, k, edge] = int(np.sign(decisive))
        return found

    def loop(self, t: float, sides: Sides) -> ClosedLoop:
        """Hand and controller under the load and the frictions of that time and place."""
        # At rest on an edge a contact has the smaller friction of both sides.
        both = [self._factors({edge: at or side for edge, at in sides.items()}) for side in (-1, 1)]
        factors = np.minimum(*both)
        load = np.zeros(3)
        for pulse in self.scenario.pulses:
            if pulse.time <= t < pulse.time + pulse.duration:
                load += (*pulse.force, pulse.moment)
        return self.plain.with_friction(factors)._replace(load=load)

    def _factors(self, sides: Sides) -> Array:
        """What the friction of every contact is multiplied by, ``(n,)``."""
        factors = np.ones(len(self.scenario.fingers))
        for i, k in {(i, k) for i, k, _ in sides}:
            if sum(side for (c, p, _), side in sides.items() if (c, p) == (i, k)) == 0:
                factors[i] *= self.scenario.patches[k].friction_factor
        return factors

    def edge_guards(self, sides: Sides) -> Iterator[Guard]:
        """One event function per edge: falls through zero where the contact reaches it."""
        for (i, _, edge), side in sides.items():

            def guard(
                t: float, z: Array, i: int = i, edge: float = edge, side: int = side
            ) -> float:
                return float(side * (z[6 + i] - edge))

            guard.terminal = True
            guard.direction = -1.0
            yield guard

    def _edges(self, t: float) -> Iterator[Edge]:
        for i, finger in enumerate(self.scenario.fingers):
            for k, patch in enumerate(self.scenario.patches):
                if patch.face == finger.face and _is_there(patch, t):
                    middle = patch.centre - finger.contact_offset
                    yield i, k, middle - patch.half_length
                    yield i, k, middle + patch.half_length


def _is_there(patch: Patch, t: float) -> bool:
    return patch.start_time <= t and (patch.end_time is None or t < patch.end_time)
