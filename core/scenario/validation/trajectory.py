"""Checks that the desired motion exists and is continuous in position and velocity."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario import HandScenario, TrajectoryParameters
from slipgrasp.core.scenario.motion import SAME_TIME
from slipgrasp.core.scenario.scenario import AnySetPoint, SpatialTrajectory

MIN_RAMP = 1e-3
MIN_TABLE_STEP = 1e-3
SAME_POSE = 1e-9


def check_trajectory(scenario: HandScenario) -> Iterator[FieldError]:
    """Checks that the parameters of this kind give a smooth motion from the start pose."""
    trajectory = scenario.trajectory
    if trajectory.kind == "set-points":
        if not trajectory.set_points:
            yield _nothing_to_do("set_points", "set-points", "at least one move")
        yield from _check_moves(trajectory.set_points)
    elif trajectory.kind == "table":
        columns = ", ".join(scenario.space.table_columns)
        if not trajectory.table:
            yield _nothing_to_do("table", "table", f"rows of {columns}")
            return
        yield from _check_table(trajectory.table, trajectory.table_start)
    elif trajectory.kind != "coast":
        yield from _check_cycles(trajectory)


def _check_moves(points: Sequence[AnySetPoint]) -> Iterator[FieldError]:
    """Checks that motions do not overlap."""
    for i in range(1, len(points)):
        end = points[i - 1].time + points[i - 1].duration
        if points[i].time < end - SAME_TIME:
            key = f"trajectory.set_points.{i}.time"
            yield FieldError(
                field=key,
                value=points[i].time,
                limit=f"at least {end:g} s",
                message=(
                    f"{key} is {points[i].time:g} s, before the motion to set-point {i - 1} ends "
                    f"at {end:g} s; start later, or shorten trajectory.set_points.{i - 1}.duration"
                ),
            )


def _check_cycles(trajectory: TrajectoryParameters | SpatialTrajectory) -> Iterator[FieldError]:
    """Checks that cycles last long enough to speed up and to brake."""
    ramp, longest = trajectory.acceleration_time, trajectory.cycles * trajectory.period
    if ramp < MIN_RAMP:
        yield FieldError(
            field="trajectory.acceleration_time",
            value=ramp,
            limit=f"at least {MIN_RAMP:g} s",
            message=(
                f"trajectory.acceleration_time is {ramp:g} s, which makes the velocity jump; a "
                f"{trajectory.kind} needs at least {MIN_RAMP:g} s to speed up from rest"
            ),
        )
    if ramp > longest + SAME_TIME:
        least = ramp / trajectory.period
        yield FieldError(
            field="trajectory.cycles",
            value=trajectory.cycles,
            limit=f"at least {least:g}",
            message=(
                f"trajectory.cycles is {trajectory.cycles:g}, too few to speed up and brake in "
                f"{ramp:g} s each; give at least {least:g} cycles of {trajectory.period:g} s, or "
                f"an acceleration_time of at most {longest:g} s"
            ),
        )


def _check_table(table: Sequence[Sequence[float]], start: Sequence[float]) -> Iterator[FieldError]:
    """Checks that the rows start at the start pose and are in order.

    Args:
        table: Rows of time and pose.
        start: The start pose as a row.
    """
    if table[0][0] != 0.0:
        yield FieldError(
            field="trajectory.table.0.0",
            value=table[0][0],
            limit="0 s",
            message=(
                f"trajectory.table.0.0 is {table[0][0]:g} s; the first row is the start, at 0 s"
            ),
        )
    for axis, (value, begin) in enumerate(zip(table[0][1:], start, strict=True)):
        if abs(value - begin) > SAME_POSE:
            key = f"trajectory.table.0.{axis + 1}"
            # A rotation vector is relative to the start attitude.
            other = "" if len(start) > 3 <= axis else f", or set trajectory.start.{axis} to it"
            yield FieldError(
                field=key,
                value=value,
                limit=f"{begin:.10g}",
                message=(
                    f"{key} is {value:.10g}, but the object starts at {begin:.10g}; make the first "
                    f"row the start pose{other}"
                ),
            )
    for i in range(1, len(table)):
        least = table[i - 1][0] + MIN_TABLE_STEP
        if table[i][0] < least - SAME_TIME:
            key = f"trajectory.table.{i}.0"
            yield FieldError(
                field=key,
                value=table[i][0],
                limit=f"at least {least:g} s",
                message=(
                    f"{key} is {table[i][0]:g} s after a row at {table[i - 1][0]:g} s; times must "
                    f"increase from row to row by at least {MIN_TABLE_STEP:g} s"
                ),
            )


def _nothing_to_do(name: str, kind: str, content: str) -> FieldError:
    """Returns the error for a kind of motion whose list is empty."""
    key = f"trajectory.{name}"
    return FieldError(
        field=key,
        value=0,
        limit=content,
        message=(
            f"{key} is empty, but trajectory.kind is {kind}; give {content}, or choose another kind"
        ),
    )
