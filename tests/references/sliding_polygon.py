"""Two point tips pressed on a regular polygon that they slide around, corner after corner.

Between corners a tip obeys the equation of its face. At a corner it goes over to the next face by
an impulse along the normal of that face, with its share of friction, that leaves it no velocity
across: the tip is taken to stay on the object, as it does on a smooth curve. With more corners the
impulses become the force that bends the way of the tip along a circle.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]

TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


class Slide(NamedTuple):
    """Tips of a mass under constant forces on a polygon, no gravity; slip keeps its direction.

    Attributes:
        sides: Of the polygon, whose faces touch a circle of the radius.
        radius: Of that circle [m].
        mass: Of the object [kg].
        inertia: Of the object [kg m^2].
        tip_mass: Of each tip [kg].
        friction: Of both contacts.
        forces: On the tips, ``(2, 2)`` [N].
        load: On the object, force and moment, ``(3,)``.
        turns: 1 where a tip slips counterclockwise around the object, -1 clockwise, ``(2,)``.
    """

    sides: int
    radius: float
    mass: float
    inertia: float
    tip_mass: float
    friction: float
    forces: Array
    load: Array
    turns: Array

    def run(self, start: Array, duration: float) -> Array:
        """Pose and both tips, then their velocities, ``(14,)``, after a time from rest.

        Args:
            start: Pose of the object (angle 0) and the tips, in the middle of two faces, ``(7,)``.
            duration: The time [s].
        """
        state, t = np.concatenate([start, np.zeros(7)]), 0.0
        angles = np.arctan2(*(start[3:].reshape(2, 2) - start[:2]).T[::-1])
        faces = np.rint(angles * self.sides / (2.0 * np.pi)).astype(int)
        half = self.radius * np.tan(np.pi / self.sides)
        while True:

            def to_corner(_t: float, state: Array, i: int, faces: Array = faces) -> float:
                _, tangent, along = self._contact(state, faces, i)
                return half - along @ tangent

            events = [lambda t, y, i=i: to_corner(t, y, i) for i in range(2)]
            for event in events:
                event.terminal, event.direction = True, -1.0
            found = solve_ivp(
                lambda _t, y, faces=faces: self._rate(y, faces),
                (t, duration),
                state,
                rtol=1e-9,
                atol=1e-11,
                events=events,
            )
            t, state = float(found.t[-1]), found.y[:, -1].copy()
            reached = [i for i in range(2) if len(found.t_events[i])]
            if not reached:
                return state
            faces = faces.copy()
            faces[reached] += self.turns[reached].astype(int)
            state[7:] += self._across(state, faces) @ np.linalg.solve(
                self._normals(state, faces) @ self._across(state, faces),
                -self._normals(state, faces) @ state[7:],
            )

    def _contact(self, state: Array, faces: Array, i: int) -> tuple[Array, Array, Array]:
        """Inward normal and direction of slip of a face, and the tip from the centre, world."""
        angle = state[2] + 2.0 * np.pi * faces[i] / self.sides
        outward = np.array([np.cos(angle), np.sin(angle)])
        tip = state[3 + 2 * i : 5 + 2 * i] - state[:2]
        return -outward, self.turns[i] * TURN @ outward, tip

    def _normals(self, state: Array, faces: Array) -> Array:
        """Velocities of the tips along the normals of their faces, by all velocities, ``(2, 7)``.

        Of points on the object below the tips: the rows are those of the normal forces too.
        """
        rows = np.zeros((2, 7))
        for i in range(2):
            normal, _, tip = self._contact(state, faces, i)
            rows[i, :2], rows[i, 2] = -normal, -normal @ TURN @ tip
            rows[i, 3 + 2 * i : 5 + 2 * i] = normal
        return rows

    def _across(self, state: Array, faces: Array) -> Array:
        """Accelerations of everything per normal force, with friction, ``(7, 2)``."""
        columns = np.zeros((7, 2))
        for i in range(2):
            normal, tangent, tip = self._contact(state, faces, i)
            force = normal + self.friction * tangent
            columns[:2, i], columns[2, i] = force, tip @ TURN.T @ force
            columns[3 + 2 * i : 5 + 2 * i, i] = -force
        return columns / self._masses()[:, None]

    def _masses(self) -> Array:
        return np.array([self.mass, self.mass, self.inertia, *[self.tip_mass] * 4])

    def _rate(self, state: Array, faces: Array) -> Array:
        """Velocities and accelerations while both tips slide on their faces."""
        spin, velocity = state[9], state[7:]
        free = np.concatenate([self.load, self.forces.ravel()]) / self._masses()
        normals, drift = self._normals(state, faces), np.zeros(2)
        for i in range(2):
            normal, _, tip = self._contact(state, faces, i)
            moving = velocity[3 + 2 * i : 5 + 2 * i] - velocity[:2]
            # d/dt of n . (e' - v - w S d) at zero accelerations, with n' = w S n.
            slipping = moving - spin * TURN @ tip
            drift[i] = spin * (TURN @ normal) @ slipping - normal @ (spin * TURN @ moving)
        across = self._across(state, faces)
        forces = np.linalg.solve(normals @ across, -normals @ free - drift)
        return np.concatenate([velocity, free + across @ forces])
