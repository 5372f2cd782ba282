"""The documents at both ends of a recording: how the run was set up and how it ended.

At the start stand the complete scenario, what its parameters mean, and the versions; at
the end outcome, reason, warnings, metrics and message counts. All are JSON, in which
Python's shortest representation of a float reads back to the same bits.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any

from core.loading import load_scenario, preset_names, scenario_from_mapping
from core.parameters import Parameter, describe
from core.result import Metrics, RunResult
from core.scenario import MAX_FINGERS, MAX_UNKNOWNS, Change, Scenario
from core.trace import TraceShape
from core.types import Outcome, Reason, RunWarning
from recordings.versions import FORMAT_VERSION, program_version

__all__ = [
    "PARAMETERS_ATTACHMENT",
    "PROFILE",
    "SCENARIO_ATTACHMENT",
    "START",
    "STOP",
    "Ending",
    "parameter_templates",
    "parameters_document",
    "read_scenario",
    "read_shape",
    "read_stop",
    "scenario_document",
    "start_document",
    "stop_document",
]

PROFILE = "slipgrasp"
START = "slipgrasp/start"
STOP = "slipgrasp/stop"
SCENARIO_ATTACHMENT = "scenario.json"
PARAMETERS_ATTACHMENT = "parameters.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ending:
    """How a recorded run ended, and how many messages each topic holds."""

    outcome: Outcome
    reason: Reason | None
    warnings: tuple[RunWarning, ...]
    metrics: Metrics
    counts: dict[str, int]


def start_document(shape: TraceShape) -> dict[str, str]:
    """Versions of format and program, and the widths of the signals."""
    return {
        "format": str(FORMAT_VERSION),
        "program": program_version(),
        "contacts": str(shape.num_contacts),
        "unknowns": json.dumps(shape.unknowns),
    }


def read_shape(start: Mapping[str, str]) -> TraceShape:
    """The trace's shape from a start document.

    Raises:
        KeyError: If an entry is missing.
        ValueError: If an entry is not what it should be.
    """
    num_contacts = int(start["contacts"])
    unknowns = tuple(map(str, json.loads(start["unknowns"])))
    if not 1 <= num_contacts <= MAX_FINGERS or len(unknowns) > MAX_UNKNOWNS:
        raise ValueError("more contacts or unknowns than a scenario can have")
    return TraceShape(num_contacts, unknowns)


def scenario_document(scenario: Scenario) -> bytes:
    """The complete scenario as JSON."""
    return json.dumps(scenario.to_mapping(), ensure_ascii=False, indent=1).encode()


def read_scenario(document: bytes) -> Scenario:
    """The inverse of `scenario_document`, validated."""
    return scenario_from_mapping(json.loads(document))


@cache
def parameter_templates() -> dict[str, Parameter]:
    """Every parameter there is, by dotted key with 0 for each index of a list."""
    change = Change(time=1.0, parameter="object.mass", value=1.0)
    scenario = replace(load_scenario(preset_names()[0]), changes=(change,))
    return {
        key: parameter
        for key, parameter in describe(scenario).items()
        if all(part == "0" for part in key.split(".") if part.isdigit())
    }


@cache
def parameters_document() -> bytes:
    """What the scenario's parameters mean: sentence, unit and allowed values, as JSON."""
    table = {
        key: {"text": parameter.text, "unit": parameter.unit, "allowed": parameter.limit}
        for key, parameter in parameter_templates().items()
    }
    return json.dumps(table, ensure_ascii=False, indent=1).encode()


def stop_document(result: RunResult, counts: Mapping[str, int]) -> dict[str, str]:
    """Outcome, reason, warnings, metrics and message counts by topic.

    Raises:
        ValueError: If a number is not finite.
    """
    return {
        "outcome": result.outcome.value,
        "reason": _to_json(None if result.reason is None else asdict(result.reason)),
        "warnings": _to_json([asdict(warning) for warning in result.warnings]),
        "metrics": _to_json(asdict(result.metrics)),
        "counts": _to_json(dict(counts)),
    }


def read_stop(document: Mapping[str, str]) -> Ending:
    """The inverse of `stop_document`."""
    reason = json.loads(document["reason"])
    return Ending(
        outcome=Outcome(document["outcome"]),
        reason=None if reason is None else Reason(**reason),
        warnings=tuple(RunWarning(**warning) for warning in json.loads(document["warnings"])),
        metrics=_read_metrics(json.loads(document["metrics"])),
        counts=json.loads(document["counts"]),
    )


def _read_metrics(values: Mapping[str, Any]) -> Metrics:
    """JSON knows no tuples; every list of the metrics is one."""
    fields: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value for key, value in values.items()
    }
    return Metrics(**fields)


def _to_json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
