"""Differences between the kinds of scenario, as data: hands, a body on a support, a rail.

Common code uses this data without branches; separate code (a kernel, geometry, text) is in tables
by `Space`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Space:
    """The kind of a scenario: a planar or spatial hand, a body on a support, or on a rail.

    Attributes:
        name: ``planar``, ``spatial``, ``support`` or ``rail``.
        positions: Names of the coordinates of the object's position.
        turns: Names of the coordinates of its attitude.
        pose: Names of the numbers of a pose.
        rotation: Names of the coordinates of a rotation in a table of poses.
        tangents: Names of the tangents of a face; empty if there is only one.
        joints_per_finger: Number of joints of every finger.
        has_paths: Whether the distance travelled by a fingertip is a separate signal.
        has_pads: Whether fingertips may be soft.
        slip_signal: The signal with the slip of a fingertip as one number.
        slip_words: Name of that signal as text.
        force_index: Index of F for the tangential force: one component, or its magnitude.
        phases: Numbers of the phases that a contact can have.
        inertias: Keys of the moments of inertia of the object.
        has_hand: Whether fingers hold the object; otherwise it slides on a support or a rail.
        has_control: Whether joints move the object along a desired motion.
        bare_contacts: Number of contacts without joints.
    """

    name: str
    positions: tuple[str, ...]
    turns: tuple[str, ...]
    pose: tuple[str, ...]
    rotation: tuple[str, ...]
    tangents: tuple[str, ...]
    joints_per_finger: int
    has_paths: bool
    has_pads: bool
    slip_signal: str
    slip_words: str
    force_index: str
    phases: tuple[int, ...]
    inertias: tuple[str, ...]
    has_hand: bool = True
    has_control: bool = True
    bare_contacts: int = 0

    def __reduce__(self) -> tuple[Callable[[str], Space], tuple[str]]:
        """Copying and unpickling return the same object."""
        return space_called, (self.name,)

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates of the object in its velocity and error."""
        return self.positions + self.turns

    @property
    def errors(self) -> tuple[str, ...]:
        """Coordinates of the tracking error; none without control."""
        return self.coordinates if self.has_control else ()

    @property
    def num_positions(self) -> int:
        """Number of coordinates of a position."""
        return len(self.positions)

    @property
    def num_tangents(self) -> int:
        """Number of tangents of a face."""
        return len(self.tangents)

    @property
    def table_columns(self) -> tuple[str, ...]:
        """Names of the columns of a table of poses."""
        return ("t", *self.positions, *self.rotation)

    def num_coordinates(self, num_fingers: int) -> int:
        """Number of coordinates of the reduced form: those of the object, and the slips.

        Args:
            num_fingers: Number of fingers.
        """
        return len(self.coordinates) + self.num_tangents * num_fingers


PLANAR = Space(
    name="planar",
    positions=("x", "y"),
    turns=("theta",),
    pose=("x", "y", "theta"),
    rotation=("theta",),
    tangents=("",),
    joints_per_finger=2,
    has_paths=False,
    has_pads=False,
    slip_signal="slip",
    slip_words="slip",
    force_index="x",
    phases=(-1, 0, 1),
    inertias=("object.inertia",),
)
SPATIAL = Space(
    name="spatial",
    positions=("x", "y", "z"),
    turns=("turn_x", "turn_y", "turn_z"),
    pose=("x", "y", "z", "qw", "qx", "qy", "qz"),
    rotation=("rx", "ry", "rz"),
    tangents=("x", "y"),
    joints_per_finger=3,
    has_paths=True,
    has_pads=True,
    slip_signal="slip_path",
    slip_words="distance slid",
    force_index="t",
    # First the cone, then one tangent and both tangents of the pyramid.
    phases=(0, 2, 10, 4, 8, 6, 11, 9, 5, 3),
    inertias=("object.inertias.0", "object.inertias.1", "object.inertias.2"),
)
SUPPORT = Space(
    name="support",
    positions=("x", "y"),
    turns=("theta",),
    pose=("x", "y", "theta"),
    rotation=("theta",),
    tangents=("x", "y"),
    joints_per_finger=0,
    has_paths=True,
    has_pads=True,
    slip_signal="slip_path",
    slip_words="distance slid",
    force_index="t",
    phases=(0, 2),
    inertias=("object.inertia",),
    has_hand=False,
    has_control=False,
)
RAIL = Space(
    name="rail",
    positions=("x",),
    turns=(),
    pose=("x",),
    rotation=(),
    tangents=("",),
    joints_per_finger=2,
    has_paths=False,
    has_pads=False,
    slip_signal="slip",
    slip_words="slip",
    force_index="t",
    phases=(-1, 0, 1),
    inertias=(),
    has_hand=False,
    bare_contacts=1,
)
HANDS = (PLANAR, SPATIAL)
SPACES = (*HANDS, SUPPORT, RAIL)


def space_called(name: str) -> Space:
    """Returns the space with a name.

    Args:
        name: ``planar``, ``spatial``, ``support`` or ``rail``.
    """
    return next(space for space in SPACES if space.name == name)


def space_of_errors(num_coordinates: int) -> Space:
    """Returns the space in which a tracking error has this number of coordinates.

    Args:
        num_coordinates: 3, 6, 1 on a rail, or 0 without control.
    """
    return next(space for space in SPACES if len(space.errors) == num_coordinates)
