"""The control laws of a scenario, initial and by timed changes."""

from __future__ import annotations

from collections.abc import Iterator

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.custom_laws import (
    LAW,
    LAW_PARAMETERS,
    CustomLaw,
    Diagnostic,
    custom_law,
    law_names,
)
from slipgrasp.core.scenario.laws import CONTROL_LAWS


def kinds_in(scenario: Scenario) -> Iterator[str]:
    """Every law of a scenario in order of time, without repetition."""
    later = (str(change.value) for change in scenario.changes if change.parameter == LAW)
    yield from dict.fromkeys((scenario.controller.kind, *later))


def custom_kind_in(scenario: Scenario) -> str | None:
    """The name of the custom law of a scenario, if any; a valid scenario has at most one."""
    return next((kind for kind in kinds_in(scenario) if kind not in CONTROL_LAWS), None)


def is_of_unknown_law(scenario: Scenario, key: str) -> bool:
    """Whether a key may be a parameter of a law that is not loaded."""
    unknown = any(kind not in law_names() for kind in kinds_in(scenario))
    return unknown and key.startswith(f"{LAW_PARAMETERS}.")


def custom_law_in(scenario: Scenario) -> CustomLaw | None:
    """The custom law of a scenario, if it is loaded."""
    kind = custom_kind_in(scenario)
    return None if kind is None else custom_law(kind)


def diagnostics_of(scenario: Scenario) -> tuple[Diagnostic, ...]:
    """The diagnostics of the custom law of a scenario."""
    law = custom_law_in(scenario)
    return () if law is None else law.diagnostics
