"""Checks that an object is a convex polygon around its centre of mass, or round."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.geometry import outline

MIN_EDGE = 1e-3

Vectors = NDArray[np.float64]


def check_outline(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that the corners go once around the centre of mass, with a left turn at each."""
    if not scenario.object.corners:
        return
    if scenario.object.is_round:
        yield _shape_error(scenario)
        return
    corners = outline(scenario.object)
    edges = np.roll(corners, -1, axis=0) - corners
    # Each check assumes that the previous ones passed.
    for error in (_count_error(edges), _length_error(edges), _turn_error(edges)):
        if error is not None:
            yield error
            return
    yield from _centre_errors(corners, edges)


def _shape_error(scenario: Scenario) -> FieldError:
    shape = scenario.object.shape
    words = (
        f"are given, but object.shape is '{shape}', which has none; omit them or choose the other "
        "shape"
    )
    return FieldError.at("object.corners", len(scenario.object.corners), "none", words)


def _count_error(edges: Vectors) -> FieldError | None:
    if len(edges) >= 3:
        return None
    words = f"are {len(edges)}; give at least 3, or none for a rectangle or a box"
    return FieldError.at("object.corners", len(edges), "at least 3 corners, or none", words)


def _length_error(edges: Vectors) -> FieldError | None:
    lengths = np.hypot(edges[:, 0], edges[:, 1])
    k = int(lengths.argmin())
    if lengths[k] >= MIN_EDGE:
        return None
    words = (
        f"object.corners: edge-{k} is {lengths[k]:.3g} m long, less than the minimum {MIN_EDGE:g} "
        "m; move its corners apart or omit one"
    )
    limit = f"edges of at least {MIN_EDGE:g} m"
    return FieldError(f"object.corners.{k}", float(lengths[k]), limit, words)


def _turn_error(edges: Vectors) -> FieldError | None:
    following = np.roll(edges, -1, axis=0)
    turns = np.arctan2(_cross(edges, following), (edges * following).sum(axis=1))
    # A star turns left at every corner too, but goes around more than once.
    if turns.min() > 0.0 and turns.sum() < 3.0 * np.pi:
        return None
    field, k = "object.corners", (int(turns.argmin()) + 1) % len(edges)
    if turns.max() < 0.0:
        words = "run clockwise; give them in the opposite order"
    elif turns.min() > 0.0:
        words = "go around more than once, as a star does; give the corners of a convex polygon"
    else:
        field = f"object.corners.{k}"
        words = (
            f"do not turn left at corner {k}; the corners of a convex polygon, counterclockwise, "
            "all turn left: move or omit this one"
        )
    least, limit = f"{np.degrees(turns.min()):.3g} degrees", "convex, counterclockwise"
    return FieldError(field, least, limit, f"object.corners {words}")


def _centre_errors(corners: Vectors, edges: Vectors) -> Iterator[FieldError]:
    depths = _cross(corners, edges) / np.hypot(edges[:, 0], edges[:, 1])
    k = int(depths.argmin())
    if depths[k] <= 0.0:
        words = (
            f"object.corners: the centre of mass (0, 0) lies {-depths[k]:.3g} m beyond edge-{k}; "
            "give the corners relative to the centre of mass"
        )
        limit = "the centre of mass (0, 0) strictly inside"
        yield FieldError("object.corners", float(depths[k]), limit, words)


def _cross(a: Vectors, b: Vectors) -> Vectors:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
