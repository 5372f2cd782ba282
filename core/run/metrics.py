"""Metrics of a run: definitions and computation.

The annotation of a field of `Metrics` is the only definition of a metric; tables, REST schema,
searches and dashboard are derived from it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated, Any, Literal, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.scenario.space import PLANAR, Space, space_of_errors
from slipgrasp.core.trace.signals import TraceShape
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase, Outcome, PhaseChange

HOLD_WINDOW = 0.5
"""Time in stick at the end of a run after which the object counts as held [s]."""

MetricKind = Literal["boolean", "integer", "number"]
Coordinates = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Metric:
    """One metric, or one component of it.

    Attributes:
        text: One sentence.
        unit: SI unit, "1" for pure numbers, "" if there is none.
        per: Meaning of its components: "" (one value), coordinate, contact, pad (contact, if any
            fingertip is soft).
        name: Field of `Metrics`, or name of a component in a table: ``slip_path_0``.
        kind: Type of its values.
        of_control: Whether it exists only if joints are controlled.
    """

    text: str
    unit: str = ""
    per: Literal["", "coordinate", "contact", "pad"] = ""
    name: str = ""
    kind: MetricKind = "number"
    of_control: bool = False

    def single_values(self, num_contacts: int, space: Space = PLANAR) -> Iterator[Metric]:
        """Components of the metric: contacts by index, coordinates by letter."""
        labels = {
            "": ("",),
            "coordinate": space.errors,
            "contact": tuple(f"{contact}" for contact in range(num_contacts)),
            "pad": tuple(f"{contact}" for contact in range(num_contacts)),
        }[self.per]
        units = self.unit.split(", ")
        for i, label in enumerate(labels):
            name = f"{self.name}_{label}" if label else self.name
            # For coordinates, the last unit is that of angles, the first that of distances.
            unit = units[-1] if i >= space.num_positions else units[0]
            yield replace(self, name=name, unit=unit, per="")


@dataclass(frozen=True, slots=True, kw_only=True)
class Metrics:
    """Metrics of a run, SI units; lists have one item per contact or coordinate.

    Planar hands have three coordinates (x, y, theta), spatial hands six (x, y, z and the rotation
    vector). Each field has a `Metric` with unit and description. Metrics do not depend on the
    output rate, except for rounding: extremes are evaluated at both ends of every accepted
    integration step, inside it and in every row; integrals are sums over the accepted steps
    (docs/model.md, Metrics).
    """

    held: Annotated[
        bool | None,
        Metric(
            "Completed with every contact in stick over the last 0.5 s; None if a shorter run had "
            "no slip."
        ),
    ]
    slipping_at_end: Annotated[bool, Metric("Whether any contact slips at the end.")]
    last_slip_time: Annotated[
        float | None, Metric("Time of the end of the last slip, None if nothing slipped.", "s")
    ]
    slip_path: Annotated[
        tuple[float, ...], Metric("Distance that each fingertip slid on its face.", "m", "contact")
    ]
    peak_normal_force: Annotated[
        tuple[float, ...],
        Metric("Largest normal force of each contact at any time.", "N", "contact"),
    ]
    minimum_friction_margin: Annotated[
        tuple[float | None, ...],
        Metric("Smallest margin of each contact in stick, None if never in stick.", "N", "contact"),
    ]
    rms_tracking_error: Annotated[
        Coordinates,
        Metric("Root mean square over time, per coordinate.", "m, m, rad", "coordinate"),
    ]
    final_tracking_error: Annotated[
        Coordinates, Metric("Value at the end, per coordinate.", "m, m, rad", "coordinate")
    ]
    torque_effort: Annotated[
        float,
        Metric(
            "Integral over time of the sum of the squared joint torques (for slides: forces in N).",
            "N² m² s",
            of_control=True,
        ),
    ]
    phase_change_count: Annotated[int, Metric("Number of phase changes.", "1")]
    spin_path: Annotated[
        tuple[float, ...],
        Metric(
            "Total angle that each fingertip turned on its face; none if no fingertip is soft.",
            "rad",
            "pad",
        ),
    ] = ()
    spin_end: Annotated[
        tuple[float, ...],
        Metric("Spin of each fingertip at the end; none if no fingertip is soft.", "rad", "pad"),
    ] = ()

    def flattened(self) -> dict[str, float | int | bool | None]:
        """Values by `metric_names`, for tables: slip_path_0, rms_tracking_error_x."""
        values: list[float | int | bool | None] = []
        space = space_of_errors(len(self.final_tracking_error))
        for metric in METRICS:
            if metric.of_control and not space.has_control:
                continue
            value = getattr(self, metric.name)
            values += value if metric.per else [value]
        names = metric_names(len(self.slip_path), space, soft=len(self.spin_path) > 0)
        return dict(zip(names, values, strict=True))

    def are_of(self, num_contacts: int) -> bool:
        """True if the metrics fit a hand with this number of contacts."""
        lists = (getattr(self, metric.name) for metric in METRICS if metric.per == "contact")
        pads = {len(self.spin_path), len(self.spin_end)}
        return pads in ({0}, {num_contacts}) and all(
            len(values) == num_contacts for values in lists
        )


def _metrics() -> Iterator[Metric]:
    kinds: dict[Any, MetricKind] = {bool: "boolean", bool | None: "boolean", int: "integer"}
    for name, hint in get_type_hints(Metrics, include_extras=True).items():
        values, metric = get_args(hint)
        yield replace(metric, name=name, kind=kinds.get(values, "number"))


METRICS = tuple(_metrics())
"""Every metric, in the order of the fields."""


@cache
def single_metrics(
    num_contacts: int, space: Space = PLANAR, *, soft: bool = False
) -> tuple[Metric, ...]:
    """The components of `Metrics` as in tables.

    Args:
        num_contacts: Number of fingers.
        space: Kind of hand.
        soft: Whether any fingertip is soft.
    """
    return tuple(
        single
        for metric in METRICS
        if (soft or metric.per != "pad") and (space.has_control or not metric.of_control)
        for single in metric.single_values(num_contacts, space)
    )


@cache
def metric_names(
    num_contacts: int, space: Space = PLANAR, *, soft: bool = False
) -> tuple[str, ...]:
    """Names of the components of `Metrics` as in tables.

    Args:
        num_contacts: Number of fingers.
        space: Kind of hand.
        soft: Whether any fingertip is soft.
    """
    return tuple(metric.name for metric in single_metrics(num_contacts, space, soft=soft))


def compute_metrics(run: Record, shape: TraceShape, outcome: Outcome) -> Metrics:
    """Computes all metrics of a run.

    Args:
        run: State of the run in the kernel.
        shape: Shape of its trace.
        outcome: Outcome of the run.
    """
    tally, n = run["tally"], shape.num_contacts
    peaks = np.maximum(tally["peak_normal_force"], tally["row_peak"])
    margins = np.minimum(tally["least_margin"], tally["row_margin"])
    slipping = bool(tally["slipping"])
    span = float(tally["time"] - tally["start"])
    return Metrics(
        held=_is_held(outcome, float(tally["time"] - tally["last_slip"]), span),
        slipping_at_end=slipping,
        last_slip_time=float(tally["time"]) if slipping else _finite(run["last_stick"]),
        slip_path=tuple(tally["slip_path"][:n].tolist()),
        peak_normal_force=tuple(peaks[:n].tolist()),
        minimum_friction_margin=tuple(_finite(m) for m in margins[:n].tolist()),
        rms_tracking_error=_root_mean_square(tally),
        final_tracking_error=_numbers(tally["error"]),
        torque_effort=float(tally["effort"]),
        phase_change_count=int(run["all_changes"]),
        spin_path=_numbers(tally["spin_path"][:n]) if shape.soft else (),
        spin_end=_numbers(tally["spin_end"][:n]) if shape.soft else (),
    )


def _is_held(outcome: Outcome, rest: float, span: float) -> bool | None:
    """True if a run held the object; None if it is too short to decide.

    Args:
        outcome: Outcome of the run.
        rest: Time without slip up to the end; infinite if nothing ever slipped [s].
        span: Duration of the run [s].
    """
    if outcome is not Outcome.COMPLETED or rest < HOLD_WINDOW:
        return False
    return None if span < HOLD_WINDOW else True


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _root_mean_square(tally: Record) -> Coordinates:
    span = tally["time"] - tally["start"]
    if span == 0.0:
        return _numbers(np.abs(tally["error"]))
    return _numbers(np.sqrt(tally["squared_error"] / span))


def _numbers(values: np.ndarray) -> Coordinates:
    return tuple(values.tolist())


def metrics_of_trace(
    trace: Trace, changes: Sequence[PhaseChange], outcome: Outcome, output_rate: float
) -> Metrics:
    """Computes the metrics from the samples of a run, without the values between them.

    Integrals use the trapezoidal rule over the rows at output times and events. Recordings before
    format 7 and recovered runs have these metrics.

    Args:
        trace: The stored trace.
        changes: The phase changes.
        outcome: Outcome of the run.
        output_rate: Rows per second, apart from those at events and inside slips [Hz].
    """
    trace = trace[_tallied_rows(trace, output_rate)]
    times, sticking = trace.times, trace.phase == ContactPhase.STICK
    end, slipping = float(times[-1]), not sticking[-1].all()
    last_stick = max((c.time for c in changes if c.to_phase is ContactPhase.STICK), default=None)
    slipped = times[~sticking.all(axis=1)]
    rest = end - float(slipped[-1]) if len(slipped) else math.inf
    return Metrics(
        held=_is_held(outcome, rest, end - float(times[0])),
        slipping_at_end=slipping,
        last_slip_time=end if slipping else last_stick,
        slip_path=tuple(_slip_paths(trace).tolist()),
        peak_normal_force=tuple(trace.normal_force.max(axis=0).tolist()),
        minimum_friction_margin=least_margins(trace),
        rms_tracking_error=_rms_over_time(trace),
        final_tracking_error=_numbers(_errors_of(trace)[-1]),
        torque_effort=float(np.trapezoid((trace.joint_torque**2).sum(axis=1), times)),
        phase_change_count=len(changes),
        spin_path=_numbers(np.abs(np.diff(trace.spin, axis=0)).sum(axis=0)),
        spin_end=_numbers(trace.spin[-1]),
    )


def _slip_paths(trace: Trace) -> NDArray[np.float64]:
    if trace.shape.space.has_paths:
        return trace.slip_path[-1]
    return np.abs(np.diff(trace.slip, axis=0)).sum(axis=0)


def _tallied_rows(trace: Trace, output_rate: float) -> NDArray[np.intp]:
    """Indices of the rows in the kernel's accumulators: all except additional ones inside slips.

    A run without a trace has no additional rows, but the same metrics.
    """
    times = trace.times
    at_output_time = np.rint(times * output_rate) / output_rate == times
    at_event = np.diff(times) == 0.0
    tallied = at_output_time | (trace.phase == ContactPhase.STICK).all(axis=1)
    tallied[1:] |= at_event
    tallied[:-1] |= at_event
    tallied[-1:] = True
    return np.flatnonzero(tallied)


def _rms_over_time(trace: Trace) -> Coordinates:
    span, errors = trace.times[-1] - trace.times[0], _errors_of(trace)
    if span == 0.0:
        return _numbers(np.abs(errors[-1]))
    return _numbers(np.sqrt(np.trapezoid(errors**2, trace.times, axis=0) / span))


def _errors_of(trace: Trace) -> NDArray[np.float64]:
    """Tracking errors ``(rows, coordinates)``; no coordinates without a hand."""
    return trace.tracking_error[:, : len(trace.shape.space.errors)]


def least_margins(trace: Trace) -> tuple[float | None, ...]:
    """Smallest margin of each contact over samples in stick, without the initially assumed stick.

    The first row has assumed stick if a second one follows at the same time.
    """
    first = int(len(trace) > 1 and trace.times[1] == trace.times[0])
    sticking = trace.phase == ContactPhase.STICK
    margins = np.where(sticking, trace.friction_margin, np.inf)[first:]
    return tuple(_finite(m) for m in margins.min(axis=0, initial=np.inf).tolist())
