"""The sample cases in space: a prism or a box, three-joint fingers, and their laws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.references.spatial_composite import Learning
from tests.references.spatial_fingers import Fingers
from tests.references.spatial_law import Desired, Law, Unknowns
from tests.references.spatial_plant import Hand, Parameters, face_frame
from tests.references.spatial_run import World

Array = NDArray[np.float64]

PRISM_INERTIAS = (0.0125, 0.0125, 0.0100)
BOX_INERTIAS = tuple(np.array([0.13, 0.13, 0.08]) / 12.0)
HEIGHT = 0.366  # of the object's centre at the start [m]
REACH = 1.466  # of a base from the object's axis [m]


def around(azimuths: Array) -> Array:
    """Horizontal unit vectors at azimuths [degrees], ``(n, 3)``."""
    angles = np.radians(azimuths)
    return np.stack((np.cos(angles), np.sin(angles), np.zeros(len(angles))), axis=1)


def rods(bases: Array) -> Fingers:
    """Fingers of two uniform rods of 1 m, elbow up."""
    n = len(bases)
    ones = np.ones((n, 2))
    return Fingers(np.asarray(bases, float), ones, 0.5 * ones, ones / 12.0, -np.ones(n))


def hand_of(bases: Array, anchors: Array, normals: Array) -> Hand:
    """Rods that touch an object at given points, with inward normals there."""
    faces = np.array([face_frame(normal) for normal in normals])
    return Hand(rods(bases), np.asarray(anchors, float), faces, 9.81)


def prism_hand() -> Hand:
    """Three fingers around the prism."""
    directions = around(np.array([180.0, 300.0, 60.0]))
    return hand_of(REACH * directions, 0.1 * directions, -directions)


def lift(t: float) -> Desired:
    """The paper's lift (Eq. 64) along z, the attitude fixed."""
    starts, rates = np.array([0.0, 1.0, 6.0, 7.0]), 0.0256 * np.array([1.0, 0.0, -1.0, 0.0])
    height, speed, rate = HEIGHT, 0.0, rates[0]
    for k, start in enumerate(starts):
        if t < start - 1e-9:
            break
        until = min(t, starts[k + 1]) if k + 1 < len(starts) else t
        dt, rate = until - start, rates[k]
        height, speed = height + speed * dt + 0.5 * rate * dt**2, speed + rate * dt
    up, zero = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    return Desired(height * up, speed * up, rate * up, np.eye(3), zero, zero)


def theorem_law(n: int, p: int, **changes: object) -> Law:
    """Gains of the paper."""
    law = Law(
        position_gain=np.concatenate((np.full(6, 100.0), np.zeros(2 * n))),
        velocity_gain=np.full(6 + 2 * n, 10.0),
        lyapunov_weight=np.full(6 + 2 * n, 20.0),
        adaptation_gain=np.full(p, 1.28),
        grip_safety=1.0,
        least_force=0.0,
        distribution="hold",
        friction="cone",
        norm_bound=np.inf,
        minimum=np.full(p, -np.inf),
        maximum=np.full(p, np.inf),
    )
    return law._replace(**changes)


def masses_unknown(hand: Hand, **changes: object) -> World:
    """S1: six link masses and the object's."""
    n = len(hand.anchors)
    keys = [f"fingers.{i}.link_masses.{k}" for i in range(n) for k in range(2)]
    first = np.append([1.0, 0.6, 0.9, 0.6, 0.8, 0.6][: 2 * n], 0.5)
    truth = Parameters(np.ones((n, 2)), 1.0, np.array(PRISM_INERTIAS), np.full(n, 0.25))
    law = theorem_law(n, 2 * n + 1, **changes)
    unknowns = Unknowns((*keys, "object.mass"), truth)
    start = np.array([0.0, 0.0, HEIGHT])
    return World(hand, truth, unknowns, law, None, lift, start, first)


def frictions_unknown(
    hand: Hand, friction: Array, inertias: Array, learning: bool, **changes: object
) -> World:
    """S2 and S3: frictions, mass and inertias of the object; by Theorem 4 or least squares."""
    n = len(hand.anchors)
    keys = [f"fingers.{i}.friction" for i in range(n)]
    keys += ["object.mass", *(f"object.inertias.{k}" for k in range(3))]
    first = np.array([1.2] * n + [0.5] + [0.02] * 3)
    truth = Parameters(np.ones((n, 2)), 1.0, np.asarray(inertias), np.asarray(friction))
    p = len(first)
    start = np.array([0.0, 0.0, HEIGHT])
    unknowns = Unknowns(tuple(keys), truth)
    if not learning:
        bound = 1.2 * np.sqrt(n * 1.2**2)
        law = theorem_law(n, p, distribution="exact", norm_bound=bound)._replace(**changes)
        return World(hand, truth, unknowns, law, None, lift, start, first)
    law = theorem_law(
        n, p,
        grip_safety=1.05, least_force=0.5,
        minimum=np.array([0.05] * (n + 1) + [0.002] * 3),
        maximum=np.array([2.0] * n + [10.0] + [0.2] * 3),
    )._replace(**changes)  # fmt: skip
    deviations = np.array([3.0] * (n + 1) + [0.1] * 3)
    return World(
        hand, truth, unknowns, law, Learning(deviations, 0.1, 0.98, 1.0), lift, start, first
    )


def s1(**changes: object) -> World:
    """S1h unless the distribution is changed."""
    return masses_unknown(prism_hand(), **changes)


def s2(**changes: object) -> World:
    """Theorem 4 with equal frictions."""
    return frictions_unknown(
        prism_hand(), np.full(3, 0.25), np.array(PRISM_INERTIAS), False, **changes
    )


def s3(**changes: object) -> World:
    """S3h unless the distribution is changed."""
    return frictions_unknown(
        prism_hand(), np.array([0.25, 0.30, 0.20]), np.array(PRISM_INERTIAS), True, **changes
    )


def box_hand(kind: str) -> Hand:
    """A box held by a thumb against two fingers, from four sides, or as the planar hand does."""
    x, y, zero = np.eye(3)[0], np.eye(3)[1], np.zeros(3)
    if kind == "thumb":
        bases = [-REACH * x, REACH * x + 0.06 * y, REACH * x - 0.06 * y]
        anchors = [-0.1 * x, 0.1 * x + 0.06 * y, 0.1 * x - 0.06 * y]
        return hand_of(np.array(bases), np.array(anchors), np.array([x, -x, -x]))
    if kind == "sides":
        outward = np.array([-x, x, -y, y])
        return hand_of(REACH * outward, 0.1 * outward, -outward)
    return hand_of(np.array([zero, 2.0 * REACH * x]), 0.1 * np.array([-x, x]), np.array([x, -x]))


def box(kind: str, **changes: object) -> World:
    """The box under the law of S3h, held by three or four fingers."""
    friction = np.array([0.25, 0.30, 0.20, 0.35])[: 3 if kind == "thumb" else 4]
    return frictions_unknown(box_hand(kind), friction, BOX_INERTIAS, True, **changes)


def planar(case: int, **changes: object) -> World:
    """The planar cases I and II, held by two fingers in space."""
    hand, inertias = box_hand("planar"), np.array([0.0125, 0.01042, 0.0125])
    if case == 1:
        world = masses_unknown(hand, **{"distribution": "exact", **changes})
        world = world._replace(estimates=np.array([1.0, 0.6, 0.9, 0.6, 0.5]))
    else:
        world = frictions_unknown(hand, np.full(2, 0.25), inertias, False, **changes)
        keys = (*world.unknowns.keys[:3], "object.inertias.1")
        law = world.law._replace(
            adaptation_gain=np.full(4, 1.28),
            minimum=np.full(4, -np.inf),
            maximum=np.full(4, np.inf),
        )
        first = np.array([1.2, 1.2, 0.5, 0.02])
        world = world._replace(
            unknowns=world.unknowns._replace(keys=keys), law=law, estimates=first
        )
    truth = world.truth._replace(object_inertias=inertias)
    middle = np.array([REACH, 0.0, HEIGHT])

    def lifted(t: float) -> Desired:
        desired = lift(t)
        return desired._replace(position=desired.position + REACH * np.array([1.0, 0.0, 0.0]))

    return world._replace(
        truth=truth, unknowns=world.unknowns._replace(known=truth), position=middle, desired=lifted
    )
