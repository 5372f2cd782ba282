"""Checks that the desired motion exists and is continuous in position and velocity."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario import HandScenario, TrajectoryParameters
from slipgrasp.core.scenario.motion import SAME_TIME, SpatialTrajectory
from slipgrasp.core.scenario.scenario import AnySetPoint

MIN_RAMP = 1e-3
MIN_TABLE_STEP = 1e-3
SAME_POSE = 1e-9


def check_trajectory(scenario: HandScenario) -> Iterator[FieldError]:
    """Checks that the parameters of this kind give a smooth motion from the start pose."""
    trajectory = scenario.trajectory
    if trajectory.kind == "set-points":
        if not trajectory.set_points:
            yield _nothing_to_do("set_points", "set-points", "at least one move")
        yield from check_moves(trajectory.set_points)
    elif trajectory.kind == "table":
        columns = ", ".join(scenario.space.table_columns)
        if not trajectory.table:
            yield _nothing_to_do("table", "table", f"rows of {columns}")
            return
        yield from _check_table(trajectory.table, trajectory.table_start)
    elif trajectory.kind != "coast":
        yield from _check_cycles(trajectory)


def check_moves(points: Sequence[AnySetPoint]) -> Iterator[FieldError]:
    """Checks that motions do not overlap.

    Args:
        points: Successive motions.
    """
    for i in range(1, len(points)):
        end = points[i - 1].time + points[i - 1].duration
        if points[i].time < end - SAME_TIME:
            key = f"trajectory.set_points.{i}.time"
            words = (
                f"is {points[i].time:g} s, before the motion to set-point {i - 1} ends at {end:g} "
                f"s; start later, or shorten trajectory.set_points.{i - 1}.duration"
            )
            yield FieldError.at(key, points[i].time, f"at least {end:g} s", words)


def _check_cycles(trajectory: TrajectoryParameters | SpatialTrajectory) -> Iterator[FieldError]:
    """Checks that cycles last long enough to speed up and to brake."""
    ramp, longest = trajectory.acceleration_time, trajectory.cycles * trajectory.period
    if ramp < MIN_RAMP:
        words = (
            f"is {ramp:g} s, which makes the velocity jump; a {trajectory.kind} needs at least "
            f"{MIN_RAMP:g} s to speed up from rest"
        )
        yield FieldError.at("trajectory.acceleration_time", ramp, f"at least {MIN_RAMP:g} s", words)
    if ramp > longest + SAME_TIME:
        least = ramp / trajectory.period
        words = (
            f"is {trajectory.cycles:g}, too few to speed up and brake in {ramp:g} s each; give at "
            f"least {least:g} cycles of {trajectory.period:g} s, or an acceleration_time of at "
            f"most {longest:g} s"
        )
        yield FieldError.at("trajectory.cycles", trajectory.cycles, f"at least {least:g}", words)


def _check_table(table: Sequence[Sequence[float]], start: Sequence[float]) -> Iterator[FieldError]:
    """Checks that the rows start at the start pose and are in order.

    Args:
        table: Rows of time and pose.
        start: The start pose as a row.
    """
    if table[0][0] != 0.0:
        words = f"is {table[0][0]:g} s; the first row is the start, at 0 s"
        yield FieldError.at("trajectory.table.0.0", table[0][0], "0 s", words)
    for axis, (value, begin) in enumerate(zip(table[0][1:], start, strict=True)):
        if abs(value - begin) > SAME_POSE:
            key = f"trajectory.table.0.{axis + 1}"
            # A rotation vector is relative to the start attitude.
            other = "" if len(start) > 3 <= axis else f", or set trajectory.start.{axis} to it"
            words = (
                f"is {value:.10g}, but the object starts at {begin:.10g}; make the first row the "
                f"start pose{other}"
            )
            yield FieldError.at(key, value, f"{begin:.10g}", words)
    for i in range(1, len(table)):
        least = table[i - 1][0] + MIN_TABLE_STEP
        if table[i][0] < least - SAME_TIME:
            key = f"trajectory.table.{i}.0"
            words = (
                f"is {table[i][0]:g} s after a row at {table[i - 1][0]:g} s; times must increase "
                f"from row to row by at least {MIN_TABLE_STEP:g} s"
            )
            yield FieldError.at(key, table[i][0], f"at least {least:g} s", words)


def _nothing_to_do(name: str, kind: str, content: str) -> FieldError:
    """Returns the error for a kind of motion whose list is empty."""
    key = f"trajectory.{name}"
    words = f"is empty, but trajectory.kind is {kind}; give {content}, or choose another kind"
    return FieldError.at(key, 0, content, words)
