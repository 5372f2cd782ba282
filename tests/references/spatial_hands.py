"""Random spatial hands, with an object tilted and turning between them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tests.references.spatial_cases import around
from tests.references.spatial_fingers import Fingers
from tests.references.spatial_plant import Hand, Parameters, Phase, State, face_frame

Array = NDArray[np.float64]


class Sample(NamedTuple):
    """A hand with its parameters, at one state, under torques."""

    hand: Hand
    parameters: Parameters
    state: State
    torques: Array  # (n, 3)
    load: Array  # (6,)


def random_sample(rng: np.random.Generator, n: int) -> Sample:
    """Unequal fingers, elbows of both kinds, contacts off the middles of tilted faces."""
    outward = around(180.0 - 360.0 / n * np.arange(n))
    normals = -outward + rng.uniform(-0.3, 0.3, (n, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    fingers = Fingers(
        bases=1.466 * outward + rng.uniform(-0.1, 0.1, (n, 3)),
        lengths=rng.uniform(0.95, 1.1, (n, 2)),
        centres=rng.uniform(0.3, 0.6, (n, 2)),
        inertias=rng.uniform(0.05, 0.12, (n, 2)),
        elbows=rng.choice([-1.0, 1.0], n),
    )
    hand = Hand(
        fingers,
        anchors=0.1 * outward + rng.uniform(-0.03, 0.03, (n, 3)),
        faces=np.array([face_frame(normal) for normal in normals]),
        gravity=9.81,
    )
    parameters = Parameters(
        rng.uniform(0.5, 1.5, (n, 2)),
        rng.uniform(0.5, 2.0),
        rng.uniform(0.009, 0.0145, 3),
        rng.uniform(0.15, 0.6, n),
    )
    return Sample(
        hand, parameters, random_state(rng, n), rng.uniform(-20, 20, (n, 3)), rng.uniform(-2, 2, 6)
    )


def random_state(rng: np.random.Generator, n: int) -> State:
    """Tilted by up to half a radian or so, all in motion."""
    quaternion = np.append(1.0, rng.uniform(-0.3, 0.3, 3))
    return State(
        np.array([0.0, 0.0, 0.366]) + rng.uniform(-0.05, 0.05, 3),
        quaternion / np.linalg.norm(quaternion),
        rng.uniform(-1.0, 1.0, 6),
        rng.uniform(-0.03, 0.03, (n, 2)),
        rng.uniform(-0.3, 0.3, (n, 2)),
    )


def cone_phases(state: State) -> Iterator[Phase]:
    """Every choice of contacts that slip, each along its slip velocity."""
    speed = np.linalg.norm(state.slip_velocity, axis=1, keepdims=True)
    for slips in product((False, True), repeat=len(state.slip)):
        chosen = np.array(slips)[:, None]
        sticks = np.broadcast_to(~chosen, state.slip.shape)
        yield Phase(sticks, np.where(chosen, state.slip_velocity / speed, 0.0))


def pyramid_phases(rng: np.random.Generator, n: int, count: int) -> Iterator[Phase]:
    """Some of the 9^n phases of the pyramid."""
    for _ in range(count):
        directions = rng.integers(-1, 2, (n, 2)).astype(float)
        yield Phase(directions == 0.0, directions)


def at_rest_where_stuck(state: State, phase: Phase) -> State:
    """The state with no slip velocity along what sticks."""
    return state._replace(slip_velocity=np.where(phase.sticks, 0.0, state.slip_velocity))


def moved(state: State, acceleration: Array, dt: float) -> State:
    """The state a short time later at a constant acceleration ``(6 + 2n,)``."""
    velocity = state.velocity + 0.5 * dt * acceleration[:6]
    half = 0.5 * dt * velocity[3:]
    angle = float(np.linalg.norm(half))
    turn = np.append(np.cos(angle), np.sinc(angle / np.pi) * half)
    slip_rate = acceleration[6:].reshape(-1, 2)
    return State(
        state.position + dt * velocity[:3],
        _times(turn, state.quaternion),
        state.velocity + dt * acceleration[:6],
        state.slip + dt * state.slip_velocity + 0.5 * dt**2 * slip_rate,
        state.slip_velocity + dt * slip_rate,
    )


def _times(a: Array, b: Array) -> Array:
    """Product of quaternions (w, x, y, z)."""
    w = a[0] * b[0] - a[1:] @ b[1:]
    return np.append(w, a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))
