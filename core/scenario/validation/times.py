"""Whether the run is short enough, and what happens in it happens before its end."""

from __future__ import annotations

from collections.abc import Iterator

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario import Scenario

MAX_ROWS = 2_000_000


def check_times(scenario: Scenario) -> Iterator[FieldError]:
    """The trace stays small enough, and changes happen before the end."""
    simulation = scenario.simulation
    rows = simulation.duration * simulation.output_rate
    if rows > MAX_ROWS:
        yield FieldError(
            field="simulation.output_rate",
            value=simulation.output_rate,
            limit=f"{MAX_ROWS} samples",
            message=(
                f"simulation.duration times output_rate asks for {rows:.3g} samples, at most "
                f"{MAX_ROWS}; lower one of them"
            ),
        )
    for i, change in enumerate(scenario.changes):
        if change.time >= simulation.duration:
            yield FieldError(
                field=f"changes.{i}.time",
                value=change.time,
                limit=f"before the end at {simulation.duration:g} s",
                message=(
                    f"changes.{i}.time is {change.time:g} s, not before the end of the run at "
                    f"{simulation.duration:g} s"
                ),
            )
