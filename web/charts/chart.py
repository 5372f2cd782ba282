"""A chart as data, and charts that hands and bodies on a support share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from slipgrasp.recordings.palette import FINGERS, MUTED, Rgb
from slipgrasp.web.model.sampling import Spot

Values = NDArray[np.float64]

LEAST_LENGTH = 0.01
"""Smaller slips, speeds and errors look like zero [mm], [mm/s], [mrad]."""


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A line of a chart, with one value per row of the trace.

    Attributes:
        key: Its name within its chart.
        label: Label in the legend.
        colour: Its colour.
        values: One per row of the trace, in the unit of the chart.
        dashed: Whether it is a reference for another line.
    """

    key: str
    label: str
    colour: Rgb
    values: Values
    dashed: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """One chart.

    Attributes:
        key: Its name among the charts of a run.
        title: Title.
        unit: Unit of its values; "1" for pure numbers.
        about: Description in a sentence.
        lines: Its lines.
        bands: Pairs of lines with a band between them: keys of the upper and the lower line.
        least: The vertical range includes at least -least to +least, so that rounding errors look
            like zero; 0 for no minimum.
    """

    key: str
    title: str
    unit: str
    about: str
    lines: tuple[Line, ...]
    bands: tuple[tuple[str, str], ...] = ()
    least: float = 0.0

    def values_at(self, spot: Spot) -> list[float]:
        """Value of each line at a position between two rows of the trace."""
        return [float(spot.read(line.values)) for line in self.lines]


def contact_lines(
    name: str, labels: Sequence[str], values: Values, *, dashed: bool = False
) -> Iterator[Line]:
    """A line for each column of ``(rows, contacts)``, in the colour of its finger.

    Args:
        name: Beginning of the keys.
        labels: Labels of the columns.
        values: The columns.
        dashed: Whether they are references for other lines.
    """
    for i, label in enumerate(labels):
        yield Line(f"{name}-{i}", label, FINGERS[i % len(FINGERS)], values[:, i], dashed)


def margin_chart(
    texts: tuple[str, str, str, str],
    names: Sequence[str],
    force: tuple[str, str, Values],
    limit: tuple[str, str, Values],
) -> Chart:
    """A chart of forces and their dashed limits, with a band between each pair.

    Args:
        texts: Key, title, unit and description.
        names: Names of the contacts.
        force: Key and symbol of the forces, and their values ``(rows, contacts)``.
        limit: The same of the limits.
    """
    lines = [
        line
        for (key, symbol, values), dashed in ((force, False), (limit, True))
        for line in contact_lines(
            key, [f"{name} {symbol}".strip() for name in names], values, dashed=dashed
        )
    ]
    bands = tuple((f"{limit[0]}-{i}", f"{force[0]}-{i}") for i in range(len(names)))
    return Chart(*texts, tuple(lines), bands)


def moment_limits(result: RunResult) -> Values:
    """Largest moment of every contact at its tangential force, ``(rows, contacts)`` [N m]."""
    trace = result.trace
    limit = trace.friction_coefficient * trace.normal_force
    rest = np.maximum(limit**2 - trace.tangential_size**2, 0.0)
    return eccentricities(result) * np.sqrt(rest)


def eccentricities(result: RunResult) -> Values:
    """Ratio of largest moment to largest tangential force of every contact, ``(contacts,)`` [m]."""
    return np.array([getattr(f, "eccentricity", 0.0) for f in result.scenario.fingers])


def balance_charts(result: RunResult) -> tuple[Chart, ...]:
    """The energy balance."""
    trace = result.trace
    potential = trace.potential_energy - trace.potential_energy[0]
    ledger = (
        ("kinetic", "kinetic", FINGERS[0], trace.kinetic_energy),
        ("potential", "lifted", FINGERS[1], potential),
        ("supplied", "supplied", FINGERS[2], trace.supplied_energy),
        ("dissipated", "lost to friction", FINGERS[5], trace.dissipated_energy),
    )
    return (
        Chart(
            "energy",
            "Energy ledger",
            "J",
            "The change of kinetic and potential energy equals the supplied energy minus the "
            "friction losses; the error is the difference.",
            (
                *(Line(*entry) for entry in ledger),
                Line("error", "error", MUTED, trace.energy_residual, dashed=True),
            ),
        ),
    )
