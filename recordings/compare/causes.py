"""From when on two scenarios ask for something different: nothing can differ before but rounding.

Pushes, patches and timed changes have a time; every other difference acts from the start. How a
run is stored and integrated is no cause: it changes how exactly the same motion is computed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from slipgrasp.core.scenario import Change, Scenario
from slipgrasp.core.scenario.parameters import parameter_differences

_NO_CAUSE = frozenset(
    f"simulation.{name}"
    for name in (
        "output_rate",
        "relative_tolerance",
        "absolute_tolerance",
        "max_step",
        "duration",
        "max_steps",
        "chatter_changes",
        "chatter_window",
    )
) | {"title"}
"""What decides how a run is stored, how exactly it is computed and when it ends."""


def first_cause(a: Scenario, b: Scenario) -> float | None:
    """When the first difference of two scenarios begins to act [s]; None if none ever does."""
    calm = (replace(each, pulses=(), patches=(), changes=()) for each in (a, b))
    if any(difference.key not in _NO_CAUSE for difference in parameter_differences(*calm)):
        return 0.0
    instants = sorted({0.0, *_instants(a), *_instants(b)})
    return next((t for t in instants if _acting(a, t) != _acting(b, t)), None)


def _instants(scenario: Scenario) -> Iterator[float]:
    """When something begins or ends in a scenario."""
    for pulse in scenario.pulses:
        yield from (pulse.time, pulse.time + pulse.duration)
    for patch in scenario.patches:
        yield from (time for time in (patch.start_time, patch.end_time) if time is not None)
    yield from (change.time for change in scenario.changes)


def _acting(scenario: Scenario, t: float) -> tuple[Any, ...]:
    """What acts on a run from some time on until the next one [s], in an order of its own."""
    changes = [change for change in scenario.changes if change.time <= t]
    values = {change.parameter: change.value for change in sorted(changes, key=_time)}
    pulses = [p for p in scenario.pulses if p.time <= t < p.time + p.duration]
    patches = [
        (p.face, p.centre, p.half_length, values.get(_factor_key(i), p.friction_factor))
        for i, p in enumerate(scenario.patches)
        if p.start_time <= t and (p.end_time is None or t < p.end_time)
    ]
    factors = {_factor_key(i) for i in range(len(scenario.patches))}
    # An estimate that is set anew need not have had that value until then.
    resets = [c for c in changes if c.time == t and c.parameter.startswith("estimates.")]
    return (
        sorted((p.force, p.moment) for p in pulses),
        sorted(patches),
        {key: value for key, value in values.items() if key not in factors},
        sorted((c.parameter, repr(c.value)) for c in resets),
    )


def _time(change: Change) -> float:
    return change.time


def _factor_key(index: int) -> str:
    return f"patches.{index}.friction_factor"
