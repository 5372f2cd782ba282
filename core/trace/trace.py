"""The trace of a run: its samples as rows, selections of them, and derived quantities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.trace.frames import trace_to_pandas, trace_to_xarray
from slipgrasp.core.trace.signals import SIGNALS, Samples, Signal, TraceShape

if TYPE_CHECKING:
    import pandas
    import xarray


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trace(Samples):
    """The signals of a run over time."""

    @classmethod
    def from_rows(cls, shape: TraceShape, rows: NDArray[np.float64]) -> Trace:
        """Creates a trace from rows ``(rows, shape.num_columns)`` in the order of `SIGNALS`.

        Its arrays are views of ``rows``, except for integers.
        """
        arrays = {}
        start, widths = 0, shape.widths
        for signal in SIGNALS:
            stop = start + widths[signal.per]
            columns = rows[:, start] if signal.per == "" else rows[:, start:stop]
            arrays[signal.name] = columns.astype(np.int8) if signal.holds_phases else columns
            start = stop
        return cls(shape=shape, **arrays)

    def to_rows(self, signals: Sequence[Signal] | None = None) -> NDArray[np.float64]:
        """The inverse of `from_rows`: shape ``(rows, shape.num_columns)``.

        Args:
            signals: Signals to include; all of them if None.
        """
        n, widths = len(self), self.shape.widths
        columns = [
            np.asarray(getattr(self, signal.name), np.float64).reshape(n, widths[signal.per])
            for signal in (SIGNALS if signals is None else signals)
        ]
        return np.concatenate(columns, axis=1)

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, rows: slice | NDArray[np.intp]) -> Trace:
        """Returns the trace of some of the rows; for a slice its arrays are views."""
        arrays = {signal.name: getattr(self, signal.name)[rows] for signal in SIGNALS}
        return Trace(shape=self.shape, absent=self.absent, **arrays)

    @property
    def desired_pose(self) -> NDArray[np.float64]:
        """Desired pose, shape ``(rows, 3)`` [m, m, rad]; desired position [m] for spatial hands."""
        return self.object_pose[:, :3] + self.tracking_error[:, :3]

    @property
    def tangential_size(self) -> NDArray[np.float64]:
        """Magnitude of the tangential force of every contact, shape ``(rows, contacts)`` [N]."""
        parts = np.abs(self.tangential_force).reshape(len(self), self.shape.num_contacts, -1)
        return np.hypot.reduce(parts, axis=2)

    @property
    def slip_of_contacts(self) -> NDArray[np.float64]:
        """Slip as one number per contact: along the only tangent, or the distance travelled [m]."""
        return getattr(self, self.shape.space.slip_signal)

    @property
    def slid_way(self) -> NDArray[np.float64]:
        """Distance that every fingertip has slid so far, shape ``(rows, contacts)`` [m]."""
        if self.shape.space.has_paths:
            return self.slip_path
        ways = np.abs(np.diff(self.slip, axis=0, prepend=self.slip[:1]))
        return np.cumsum(ways, axis=0)

    @property
    def energy_residual(self) -> NDArray[np.float64]:
        """Energy error [J], ideally 0: stored energy gained, minus supplied, plus lost."""
        stored = self.kinetic_energy + self.potential_energy
        return (stored - stored[0]) - self.supplied_energy + self.dissipated_energy

    def to_pandas(self) -> pandas.DataFrame:
        """The trace as a table: one row per sample, its index the time ``t`` [s].

        Columns have the names of the CSV export, and include all other signals
        (`slipgrasp.core.trace.columns`); phases are categorical text; ``attrs["units"]`` has the
        SI units.

        Raises:
            MissingPackageError: If pandas is not installed.
        """
        return trace_to_pandas(self)

    def to_xarray(self) -> xarray.Dataset:
        """The trace as labelled arrays: one variable per signal, with its unit.

        Dimensions are time, coordinate (x, y, theta), contact, joint (finger_joint), unknown
        (dotted keys) and, for laws with diagnostics, diagnostic; spatial hands also have pose and
        tangent. Phases are the numbers of `slipgrasp.core.trace.types.ContactPhase`.

        Raises:
            MissingPackageError: If xarray is not installed.
        """
        return trace_to_xarray(self)


def rows_from_start(trace: Trace) -> slice:
    """All rows from the phase selection at the start on; earlier ones do not affect motion."""
    return slice(int(np.searchsorted(trace.times, trace.times[0], side="right")) - 1, None)
