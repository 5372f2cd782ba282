"""The trace of a run: arrays over time, one definition of every signal.

The order of `SIGNALS` is the column order of a row as the kernel writes it, of the
recording's messages and of the charts; nothing else defines it again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas
    import xarray

JOINTS_PER_FINGER = 2
OBJECT_COORDINATES = ("x", "y", "theta")


@dataclass(frozen=True, slots=True)
class Signal:
    """One quantity of the trace.

    Attributes:
        name: Attribute of `Trace`.
        topic: Group it is recorded with: time, object, contacts, joints, controller, energy.
        per: What its entries stand for: "" (one number), coordinate, contact, joint, unknown.
        unit: SI unit.
        text: One sentence.
    """

    name: str
    topic: str
    per: str
    unit: str
    text: str


SIGNALS = (
    Signal("times", "time", "", "s", "Simulation time; an event gives two rows at one time."),
    Signal("object_pose", "object", "coordinate", "m, m, rad", "Pose x, y, theta."),
    Signal("object_velocity", "object", "coordinate", "m/s, m/s, rad/s", "Its first derivative."),
    Signal("object_acceleration", "object", "coordinate", "m/s², rad/s²", "Its second derivative."),
    Signal("tracking_error", "object", "coordinate", "m, m, rad", "Desired minus actual pose."),
    Signal(
        "external_wrench", "object", "coordinate", "N, N, N m", "Force and moment of the pulses."
    ),
    Signal(
        "input_rank",
        "object",
        "",
        "1",
        "Rank of B~ in the phase: how many accelerations torques choose.",
    ),
    Signal(
        "controllability",
        "object",
        "coordinate",
        "1",
        "Share of an acceleration that torques can produce whatever else is asked.",
    ),
    Signal("slip", "contacts", "contact", "m", "Displacement of the fingertip along the face."),
    Signal("slip_velocity", "contacts", "contact", "m/s", "Its first derivative."),
    Signal("slip_acceleration", "contacts", "contact", "m/s²", "Its second derivative."),
    Signal("phase", "contacts", "contact", "", "0 stick, 1 slip forward, -1 slip backward."),
    Signal("believed_phase", "contacts", "contact", "", "The phase the controller acts on."),
    Signal("tangential_force", "contacts", "contact", "N", "F_x of the fingertip on the object."),
    Signal("normal_force", "contacts", "contact", "N", "F_n, positive pushes."),
    Signal(
        "friction_margin", "contacts", "contact", "N", "mu F_n - |F_x|, positive inside the cone."
    ),
    Signal(
        "friction_coefficient",
        "contacts",
        "contact",
        "1",
        "True friction at that time, of stick or of slip.",
    ),
    Signal("joint_position", "joints", "joint", "rad", "Joint angles, second relative to first."),
    Signal("joint_velocity", "joints", "joint", "rad/s", "Their first derivative."),
    Signal("joint_torque", "joints", "joint", "N m", "Torque that acts on the joint."),
    Signal("estimates", "controller", "unknown", "", "Estimates of the unknown parameters."),
    Signal("true_parameters", "controller", "unknown", "", "Their true values at that time."),
    Signal("lyapunov_value", "controller", "", "1", "V of Eq. 44."),
    Signal(
        "grasp_violation",
        "controller",
        "",
        "N",
        "How far the commanded force leaves the estimated cones.",
    ),
    Signal(
        "inertia_condition", "controller", "", "1", "Condition (1-norm) of the reduced inertia."
    ),
    Signal("estimated_inertia_condition", "controller", "", "1", "The same of its estimate."),
    Signal("kinetic_energy", "energy", "", "J", "Kinetic energy of object and fingers."),
    Signal("potential_energy", "energy", "", "J", "Potential energy of object and fingers."),
    Signal(
        "supplied_energy",
        "energy",
        "",
        "J",
        "Work of torques, pulses and timed changes so far.",
    ),
    Signal("dissipated_energy", "energy", "", "J", "Energy lost to friction so far."),
)

_INTEGER_SIGNALS = ("phase", "believed_phase")


@dataclass(frozen=True, slots=True)
class TraceShape:
    """How many contacts (one per finger) a trace has, and the dotted keys of its unknowns."""

    num_contacts: int
    unknowns: tuple[str, ...]

    def width(self, signal: Signal) -> int:
        """Number of columns of a signal."""
        widths = {
            "": 1,
            "coordinate": len(OBJECT_COORDINATES),
            "contact": self.num_contacts,
            "joint": JOINTS_PER_FINGER * self.num_contacts,
            "unknown": len(self.unknowns),
        }
        return widths[signal.per]

    @property
    def num_columns(self) -> int:
        """Number of columns of a whole row."""
        return sum(self.width(signal) for signal in SIGNALS)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trace:
    """What happened, over time: ``(rows,)`` or ``(rows, width)`` arrays, SI units.

    Attributes are described by `SIGNALS`. Rows are in time order; every event (phase
    change, jump of the desired acceleration, timed change) gives two rows with the same
    time, the state just before and just after. In the very first such pair the row
    before is the stick phase that every run assumes at t = 0, with the force its law
    demands: where that force lies outside its cone, the contact slips from the start.

    Signals named in ``absent`` are 0: the recording is older than they are.
    """

    shape: TraceShape
    times: NDArray[np.float64]
    object_pose: NDArray[np.float64]
    object_velocity: NDArray[np.float64]
    object_acceleration: NDArray[np.float64]
    tracking_error: NDArray[np.float64]
    external_wrench: NDArray[np.float64]
    input_rank: NDArray[np.float64]
    controllability: NDArray[np.float64]
    slip: NDArray[np.float64]
    slip_velocity: NDArray[np.float64]
    slip_acceleration: NDArray[np.float64]
    phase: NDArray[np.int8]
    believed_phase: NDArray[np.int8]
    tangential_force: NDArray[np.float64]
    normal_force: NDArray[np.float64]
    friction_margin: NDArray[np.float64]
    friction_coefficient: NDArray[np.float64]
    joint_position: NDArray[np.float64]
    joint_velocity: NDArray[np.float64]
    joint_torque: NDArray[np.float64]
    estimates: NDArray[np.float64]
    true_parameters: NDArray[np.float64]
    lyapunov_value: NDArray[np.float64]
    grasp_violation: NDArray[np.float64]
    inertia_condition: NDArray[np.float64]
    estimated_inertia_condition: NDArray[np.float64]
    kinetic_energy: NDArray[np.float64]
    potential_energy: NDArray[np.float64]
    supplied_energy: NDArray[np.float64]
    dissipated_energy: NDArray[np.float64]
    absent: frozenset[str] = frozenset()

    @classmethod
    def from_rows(cls, shape: TraceShape, rows: NDArray[np.float64]) -> Trace:
        """Builds a trace from rows ``(rows, shape.num_columns)`` in the order of `SIGNALS`.

        Its arrays are views of ``rows`` but for the integers.
        """
        arrays = {}
        start = 0
        for signal in SIGNALS:
            stop = start + shape.width(signal)
            columns = rows[:, start] if signal.per == "" else rows[:, start:stop]
            is_integer = signal.name in _INTEGER_SIGNALS
            arrays[signal.name] = columns.astype(np.int8) if is_integer else columns
            start = stop
        return cls(shape=shape, **arrays)

    def to_rows(self, signals: Sequence[Signal] = SIGNALS) -> NDArray[np.float64]:
        """The inverse of `from_rows`: shape ``(rows, shape.num_columns)``.

        Args:
            signals: Which signals; all of them by default.
        """
        columns = [
            np.asarray(getattr(self, signal.name), dtype=np.float64).reshape(
                len(self), self.shape.width(signal)
            )
            for signal in signals
        ]
        return np.concatenate(columns, axis=1)

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, rows: slice | NDArray[np.intp]) -> Trace:
        """The trace of some of the rows; of a slice its arrays are views."""
        arrays = {signal.name: getattr(self, signal.name)[rows] for signal in SIGNALS}
        return Trace(shape=self.shape, absent=self.absent, **arrays)

    @property
    def desired_pose(self) -> NDArray[np.float64]:
        """Desired object pose, shape ``(rows, 3)`` [m, m, rad]."""
        return self.object_pose + self.tracking_error

    @property
    def energy_residual(self) -> NDArray[np.float64]:
        """Energy ledger that should stay 0 [J]: stored minus initial, supplied plus dissipated."""
        stored = self.kinetic_energy + self.potential_energy
        return (stored - stored[0]) - self.supplied_energy + self.dissipated_energy

    def to_pandas(self) -> pandas.DataFrame:
        """The trace as a table: one row per sample, its index the time ``t`` [s].

        Columns are called as in the CSV export, with those of all other signals too
        (`slipgrasp.core.trace.columns`); phases are categories of words; ``attrs["units"]`` has the
        SI units.

        Raises:
            MissingPackageError: If pandas is not installed.
        """
        from slipgrasp.core.trace.frames import trace_to_pandas

        return trace_to_pandas(self)

    def to_xarray(self) -> xarray.Dataset:
        """The trace as labelled arrays: one variable per signal, with its unit.

        Dimensions are time, coordinate (x, y, theta), contact, joint (finger_joint) and
        unknown (dotted keys); phases are the numbers of `slipgrasp.core.trace.types.ContactPhase`.

        Raises:
            MissingPackageError: If xarray is not installed.
        """
        from slipgrasp.core.trace.frames import trace_to_xarray

        return trace_to_xarray(self)
