"""The signals of a trace: arrays over time, one definition of every signal.

The annotation of an attribute of `Samples` is the only definition of a signal. Columns, recorded
messages, the REST interface and labels are derived from it, and the kernel writes its rows in
the order of the attributes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Annotated, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario.custom_laws import Diagnostic
from slipgrasp.core.scenario.space import PLANAR, RAIL, SPATIAL, SUPPORT, Space

TIME_COLUMN = "t"

Floats = NDArray[np.float64]
Phases = NDArray[np.int8]


@dataclass(frozen=True, slots=True)
class Signal:
    """One quantity of the trace.

    Attributes:
        topic: Group in recordings: time, object, contacts, joints, controller, energy.
        per: Meaning of its components: "" (one number), pose, coordinate, contact, tangent (of
            contacts; two for spatial hands), path (of contacts; spatial hands only), pad (of
            contacts, if any fingertip is soft), joint, unknown, diagnostic.
        unit: SI unit, or one each if they differ.
        text: One sentence.
        slides_unit: Unit for prismatic joints.
        spatial_unit: Unit for spatial hands, if different.
        spatial_text: Description for spatial hands, if different.
        support_text: Description for a body on a support, if different.
        rail_text: Description on a rail, if different.
        of_hand: Whether it exists only if there is a hand.
        of_control: Whether it exists only if joints are controlled.
        column: Prefix of its column names; its name if None.
        name: Attribute of `Samples` that carries it.
        holds_phases: Whether its values are those of `slipgrasp.core.trace.types.ContactPhase`.
    """

    topic: str
    per: str
    unit: str
    text: str
    column: str | None = None
    slides_unit: str = ""
    spatial_unit: str = ""
    spatial_text: str = ""
    support_text: str = ""
    rail_text: str = ""
    of_hand: bool = False
    of_control: bool = False
    name: str = ""
    holds_phases: bool = False

    def unit_in(self, space: Space) -> str:
        """SI unit, or one each, for a kind of hand."""
        return (space is SPATIAL and self.spatial_unit) or self.unit

    def text_in(self, space: Space) -> str:
        """Description for a kind of scenario."""
        if space is SUPPORT and self.support_text:
            return self.support_text
        if space is RAIL and self.rail_text:
            return self.rail_text
        return (space is SPATIAL and self.spatial_text) or self.text

    @property
    def prefix(self) -> str:
        """Prefix of its column names."""
        return self.name if self.column is None else self.column


_per_coordinate = partial(Signal, "object", "coordinate")
_per_contact = partial(Signal, "contacts", "contact")
_per_tangent = partial(Signal, "contacts", "tangent")
_per_pad = partial(Signal, "contacts", "pad")
_per_joint = partial(Signal, "joints", "joint", of_control=True)
_per_unknown = partial(Signal, "controller", "unknown", "", of_control=True)
_of_law = partial(Signal, "controller", "")
_energy = partial(Signal, "energy", "", "J")


@dataclass(frozen=True, slots=True)
class TraceShape:
    """The sizes that determine the widths of a trace.

    Attributes:
        num_contacts: Number of contacts, one per finger.
        unknowns: Dotted keys of the estimated parameters.
        diagnostics: Diagnostics of a custom law; empty without one.
        space: Kind of hand, planar or spatial.
        slides: Indices of the prismatic joints among those of all fingers; they have other units.
        soft: Whether any fingertip is soft.
    """

    num_contacts: int
    unknowns: tuple[str, ...]
    diagnostics: tuple[Diagnostic, ...] = ()
    space: Space = PLANAR
    slides: tuple[int, ...] = ()
    soft: bool = False

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates of the object; the rotation vector is in world axes."""
        return self.space.coordinates

    @property
    def joints_per_finger(self) -> int:
        """Number of joints of every finger."""
        return self.space.joints_per_finger

    def has(self, signal: Signal) -> bool:
        """Whether such a trace has a signal, possibly without columns."""
        if signal.of_hand and not self.space.has_hand:
            return False
        if signal.of_control and not self.space.has_control:
            return False
        if signal.per == "pad":
            return self.soft
        return signal.per != "path" or self.space.has_paths

    @property
    def width_of_joints(self) -> int:
        """Number of joints of the hand."""
        return self.joints_per_finger * self.num_jointed

    @property
    def num_jointed(self) -> int:
        """Number of contacts with joints."""
        return self.num_contacts - self.space.bare_contacts

    @property
    def widths(self) -> dict[str, int]:
        """Number of columns of a signal by its ``per``."""
        return {
            "": 1,
            "pose": len(self.space.pose),
            "coordinate": len(self.coordinates),
            "contact": self.num_contacts,
            "tangent": self.space.num_tangents * self.num_contacts,
            "path": self.space.has_paths * self.num_contacts,
            "pad": self.soft * self.num_contacts,
            "joint": self.width_of_joints,
            "unknown": len(self.unknowns),
            "diagnostic": len(self.diagnostics),
        }

    def width(self, signal: Signal) -> int:
        """Number of columns of a signal."""
        return self.widths[signal.per]

    @property
    def num_columns(self) -> int:
        """Number of columns of a complete row."""
        widths = self.widths
        return sum(widths[signal.per] for signal in SIGNALS)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Samples:
    """Signals of a run over time: ``(rows,)`` or ``(rows, width)`` arrays, SI units.

    Each attribute has a `Signal` with unit and description. Rows are in time order; every event
    (phase change, jump of the desired acceleration, timed change) gives two rows at the same time,
    with the state just before and just after. The first such pair starts with the stick phase that
    every run assumes at t = 0, and the force that its law commands: if that force is outside its
    cone, the contact slips from the start.

    Signals named in ``absent`` are 0, because the recording was written before they existed.
    Signals that a kind of scenario does not have are 0 (`TraceShape.has`).
    """

    shape: TraceShape
    times: Annotated[
        Floats,
        Signal(
            "time",
            "",
            "s",
            "Simulation time; an event gives two rows at one time.",
            column=TIME_COLUMN,
        ),
    ]
    object_pose: Annotated[
        Floats,
        Signal(
            "object",
            "pose",
            "m, m, rad",
            "Pose x, y, theta.",
            column="",
            spatial_unit="m, m, m, 1, 1, 1, 1",
            spatial_text="Position x, y, z and unit quaternion w, x, y, z.",
        ),
    ]
    object_velocity: Annotated[
        Floats,
        _per_coordinate(
            "m/s, m/s, rad/s",
            "Velocity x, y, theta.",
            spatial_unit="m/s, m/s, m/s, rad/s, rad/s, rad/s",
            spatial_text="Velocity and angular velocity, world axes.",
        ),
    ]
    object_acceleration: Annotated[
        Floats,
        _per_coordinate(
            "m/s², rad/s²",
            "Acceleration x, y, theta.",
            spatial_unit="m/s², m/s², m/s², rad/s², rad/s², rad/s²",
            spatial_text="Acceleration and angular acceleration, world axes.",
        ),
    ]
    tracking_error: Annotated[
        Floats,
        _per_coordinate(
            "m, m, rad",
            "Desired minus actual pose.",
            column="error",
            spatial_unit="m, m, m, rad, rad, rad",
            spatial_text="Desired minus actual position; rotation vector from actual to desired.",
            of_control=True,
        ),
    ]
    external_wrench: Annotated[
        Floats,
        _per_coordinate(
            "N, N, N m", "Force and moment of the pulses.", spatial_unit="N, N, N, N m, N m, N m"
        ),
    ]
    input_rank: Annotated[
        Floats,
        Signal(
            "object",
            "",
            "1",
            "Rank of B~ in the phase: number of accelerations that torques determine.",
            of_hand=True,
        ),
    ]
    controllability: Annotated[
        Floats,
        _per_coordinate(
            "1",
            "Fraction of an acceleration that torques can produce independently of the others.",
            of_hand=True,
        ),
    ]
    slip: Annotated[
        Floats,
        _per_tangent(
            "m",
            "Displacement of the fingertip along the face.",
            spatial_text="Displacement of the fingertip along t_x and t_y of its face.",
            support_text="Displacement of the body on the support, along x and y.",
            rail_text="Of the fingertip along -t of its face, and of the object along the rail.",
        ),
    ]
    slip_velocity: Annotated[Floats, _per_tangent("m/s", "Rate of the slip.")]
    slip_acceleration: Annotated[Floats, _per_tangent("m/s²", "Second derivative of the slip.")]
    slip_path: Annotated[
        Floats,
        Signal(
            "contacts",
            "path",
            "m",
            "Distance that the fingertip has slid on its face.",
            support_text="Distance that the body has slid.",
        ),
    ]
    phase: Annotated[
        Phases,
        _per_contact(
            "", "0 stick, 1 slip forward, -1 slip backward.", spatial_text="0 stick, 2 slip."
        ),
    ]
    believed_phase: Annotated[
        Phases, _per_contact("", "The phase the controller acts on.", of_hand=True)
    ]
    tangential_force: Annotated[
        Floats,
        _per_tangent(
            "N",
            "F_x of the fingertip on the object.",
            spatial_text="F_x and F_y of the fingertip on the object, along -t_x and -t_y.",
            support_text="Friction force of the support on the body, along x and y.",
            rail_text="Of the fingertip on the object along t, and of the rail along x.",
        ),
    ]
    normal_force: Annotated[
        Floats,
        _per_contact(
            "N",
            "F_n of the fingertip on the object, positive in compression.",
            support_text="Force of the support on the body along its normal.",
            rail_text="Of the fingertip and of the rail on the object.",
        ),
    ]
    friction_margin: Annotated[
        Floats,
        _per_contact(
            "N",
            "mu F_n - |F_x|, positive inside the cone.",
            spatial_text="mu F_n - |F_t|, positive inside the cone; in the pyramid the smaller of "
            "mu F_n - |F_x| and mu F_n - |F_y|.",
            support_text="mu N - |f|, f with the friction moment over the radius; 0 in slip.",
        ),
    ]
    friction_coefficient: Annotated[
        Floats,
        _per_contact(
            "1",
            "True friction at that time, of stick or of slip.",
            support_text="Friction coefficient at that time, of rest or of sliding.",
        ),
    ]
    joint_position: Annotated[
        Floats,
        _per_joint(
            "rad",
            "Joint angles, second relative to first; positions of slides.",
            slides_unit="m",
            spatial_text="Yaw, pitch, and pitch relative to the first link; positions of slides.",
        ),
    ]
    joint_velocity: Annotated[
        Floats, _per_joint("rad/s", "Their first derivative.", slides_unit="m/s")
    ]
    joint_torque: Annotated[
        Floats,
        _per_joint(
            "N m",
            "Torque that acts on the joint (for slides: force).",
            column="torque",
            slides_unit="N",
        ),
    ]
    commanded_torque: Annotated[
        Floats,
        _per_joint(
            "N m",
            "Last torque commanded by the law, before limits and latency (for slides: force).",
            slides_unit="N",
        ),
    ]
    estimates: Annotated[
        Floats, _per_unknown("Estimates of the unknown parameters.", column="estimate")
    ]
    true_parameters: Annotated[
        Floats, _per_unknown("True values of the unknowns.", column="true_parameter")
    ]
    lyapunov_value: Annotated[
        Floats,
        _of_law(
            "1",
            "V of Eq. 44.",
            rail_text="V of Eq. 44 for the position and the mass; 0 unless the law is theorem-3.",
            of_control=True,
        ),
    ]
    grasp_violation: Annotated[
        Floats,
        _of_law("N", "How far the commanded force leaves the estimated cones.", of_hand=True),
    ]
    inertia_condition: Annotated[
        Floats, _of_law("1", "Condition (1-norm) of the reduced inertia.", of_hand=True)
    ]
    estimated_inertia_condition: Annotated[
        Floats, _of_law("1", "Condition of its estimate.", of_hand=True)
    ]
    diagnostics: Annotated[
        Floats,
        Signal(
            "controller",
            "diagnostic",
            "",
            "Diagnostics of a custom law.",
            column="law",
            of_hand=True,
        ),
    ]
    kinetic_energy: Annotated[
        Floats,
        _energy(
            "Kinetic energy of object and fingers.", support_text="Kinetic energy of the body."
        ),
    ]
    potential_energy: Annotated[
        Floats,
        _energy(
            "Potential energy of object and fingers.",
            support_text="Potential energy of the body on the incline.",
        ),
    ]
    supplied_energy: Annotated[
        Floats,
        _energy(
            "Work of torques, pulses and timed changes so far.",
            support_text="Work of pulses and timed changes so far.",
        ),
    ]
    dissipated_energy: Annotated[Floats, _energy("Energy lost to friction so far.")]
    spin: Annotated[
        Floats,
        _per_pad(
            "rad",
            "Angle by which the fingertip has turned on the face, about the normal into the "
            "object; 0 of a hard point.",
            support_text="Angle by which the body has turned.",
        ),
    ]
    spin_velocity: Annotated[Floats, _per_pad("rad/s", "Rate of this angle.")]
    torsional_moment: Annotated[
        Floats,
        _per_pad(
            "N m",
            "Moment of the fingertip on the object, about the opposite of that normal.",
            support_text="Friction moment of the support on the body.",
        ),
    ]
    absent: frozenset[str] = frozenset()


def _signals() -> Iterator[Signal]:
    for name, hint in get_type_hints(Samples, include_extras=True).items():
        if get_origin(hint) is Annotated:
            values, signal = get_args(hint)
            yield replace(signal, name=name, holds_phases=values == Phases)


SIGNALS = tuple(_signals())
"""Every signal of a trace, in the order of the columns of a row."""
