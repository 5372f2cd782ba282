"""The documents at the start and end of a recording: setup and outcome of the run.

The start contains the complete scenario, the meaning of its parameters, and the versions; the end
contains outcome, reason, warnings, metrics and message counts. All are JSON, in which Python's
shortest representation of a float reads back to the same bits.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from functools import cache, lru_cache
from typing import Any

from pydantic import TypeAdapter

from slipgrasp.core.run.metrics import Metrics
from slipgrasp.core.run.provenance import Provenance
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import (
    CONTROL_LAWS,
    MAX_DIAGNOSTICS,
    MAX_FINGERS,
    MAX_UNKNOWNS,
    PLANAR,
    RAIL,
    SPATIAL,
    SUPPORT,
    Scenario,
    Space,
)
from slipgrasp.core.scenario.chosen_laws import custom_kind_in
from slipgrasp.core.scenario.custom_laws import LAW_PARAMETERS, Diagnostic, LawIdentity
from slipgrasp.core.scenario.field_errors import template_keys
from slipgrasp.core.scenario.loading import scenario_from_mapping
from slipgrasp.core.scenario.parameters import Parameter, iterate_parameters
from slipgrasp.core.trace.signals import TraceShape
from slipgrasp.core.trace.types import Outcome, Reason, RunWarning
from slipgrasp.recordings.file.schemas import format_of
from slipgrasp.recordings.file.state_hash import digest_of
from slipgrasp.recordings.file.versions import SOFT_FORMATS, SUPPORT_FORMATS

PROFILE = "slipgrasp"
STUDY_PROFILE = "slipgrasp-study"
MEASURED_PROFILE = "slipgrasp-measured"
START = "slipgrasp/start"
STOP = "slipgrasp/stop"
SCENARIO_ATTACHMENT = "scenario.json"
PARAMETERS_ATTACHMENT = "parameters.json"

_MAX_DIGITS = 18
# The key in the start document; that of planar hands is always present, so that it comes last.
_SPACE_ENTRY: Mapping[Space, dict[str, str]] = {
    SPATIAL: {"space": "1"},
    SUPPORT: {"space": "2"},
    RAIL: {"space": "3"},
    PLANAR: {},
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Ending:
    """Outcome of a recorded run, message counts by topic, and the run's hash."""

    outcome: Outcome
    reason: Reason | None
    warnings: tuple[RunWarning, ...]
    metrics: Metrics
    counts: dict[str, int]
    state_hash: str


def start_document(
    shape: TraceShape, provenance: Provenance, seed: int, display_rate: float
) -> dict[str, str]:
    """Versions of format and program, seed of the noise, and widths of the signals."""
    law = provenance.law
    return {
        "format": str(format_of(shape)),
        "program": provenance.program,
        "kernel": provenance.kernel,
        **({} if law is None else {"law": json.dumps(asdict(law))}),
        "diagnostics": json.dumps(shape.diagnostics),
        "seed": str(seed),
        "display_rate": repr(display_rate),
        "contacts": str(shape.num_contacts),
        "unknowns": json.dumps(shape.unknowns),
        **({"slides": json.dumps(shape.slides)} if shape.slides else {}),
        **_SPACE_ENTRY[shape.space],
    }


def read_provenance(start: Mapping[str, str]) -> Provenance:
    """The program that computed the run; format 1 did not store the kernel."""
    law = read_as(LawIdentity, start["law"]) if "law" in start else None
    return Provenance(program=start["program"], kernel=start.get("kernel", ""), law=law)


def documents_hash(start: Mapping[str, str], scenario: bytes) -> bytes:
    """Hash of the documents before the first sample."""
    return digest_of(_canonical(start), scenario)


def read_shape(start: Mapping[str, str]) -> TraceShape:
    """The trace's shape from a start document.

    Raises:
        KeyError: If an entry is missing.
        ValueError: If an entry is invalid.
    """
    num_contacts = int(start["contacts"])
    unknowns = tuple(map(str, parse_json(start["unknowns"])))
    if not 1 <= num_contacts <= MAX_FINGERS or len(unknowns) > MAX_UNKNOWNS:
        raise ValueError("more contacts or unknowns than a scenario can have")
    diagnostics = read_as(tuple[Diagnostic, ...], start.get("diagnostics", "[]"))
    if len(diagnostics) > MAX_DIAGNOSTICS:
        raise ValueError("more diagnostics than a law can have")
    space = next(space for space, entry in _SPACE_ENTRY.items() if entry.items() <= start.items())
    slides = tuple(map(int, parse_json(start.get("slides", "[]"))))
    if not set(slides) <= set(range(num_contacts * space.joints_per_finger)):
        raise ValueError("slides that the hand does not have")
    soft = int(start["format"]) in (*SOFT_FORMATS, *SUPPORT_FORMATS)
    return TraceShape(num_contacts, unknowns, diagnostics, space, slides, soft)


def scenario_document(scenario: Scenario) -> bytes:
    """The complete scenario as JSON."""
    return json.dumps(scenario.to_mapping(), ensure_ascii=False, indent=1).encode()


def read_scenario(document: bytes) -> Scenario:
    """Creates the scenario from its document, and validates it."""
    return scenario_from_mapping(parse_json(document), with_law=False)


def parameters_document(scenario: Scenario) -> bytes:
    """Meaning of the parameters of a scenario: description, unit and allowed values, as JSON.

    The listed control laws are the built-in ones and those of the scenario, regardless of other
    loaded laws: equal runs give equal bytes.
    """
    own = custom_kind_in(scenario)
    if own is None:
        return _parameters_document(scenario.space, tuple(CONTROL_LAWS), ())
    controls = iterate_parameters(scenario.controller, "controller.")
    declared = (each for each in controls if each.key.startswith(f"{LAW_PARAMETERS}."))
    return _parameters_document(scenario.space, (*CONTROL_LAWS, own), tuple(declared))


@lru_cache(maxsize=8)
def _parameters_document(space: Space, laws: tuple[str, ...], own: tuple[Parameter, ...]) -> bytes:
    described = {**template_keys(space, laws), **{each.key: each for each in own}}
    table = {
        key: {"text": parameter.text, "unit": parameter.unit, "allowed": parameter.limit}
        for key, parameter in described.items()
    }
    return json.dumps(table, ensure_ascii=False, indent=1).encode()


def stop_document(
    result: RunResult, counts: Mapping[str, int], documents: bytes, state: bytes
) -> dict[str, str]:
    """Outcome, reason, warnings, metrics, message counts by topic, and hashes.

    Args:
        result: The run.
        counts: Messages of each topic.
        documents: Hash of the documents at the start.
        state: Hash of samples, phase changes and ticks.

    Raises:
        ValueError: If a number is not finite.
    """
    ending = {
        "outcome": result.outcome.value,
        "reason": _to_json(None if result.reason is None else asdict(result.reason)),
        "warnings": _to_json([asdict(warning) for warning in result.warnings]),
        "metrics": _to_json(asdict(result.metrics)),
        "counts": _to_json(dict(counts)),
        "state_hash": state.hex(),
    }
    return {**ending, "documents_hash": _ending_hash(ending, documents)}


def _ending_hash(ending: Mapping[str, str], documents: bytes) -> str:
    """Hash of all documents of a recording: those at its start and at its end."""
    return digest_of(documents, _canonical(ending)).hex()


def _canonical(document: Mapping[str, str]) -> bytes:
    return json.dumps(dict(document), sort_keys=True).encode()


def read_stop(document: Mapping[str, str], later: Mapping[str, Any]) -> Ending:
    """Reads the document of `stop_document`.

    Args:
        document: The end of a recording.
        later: Values of metrics that are newer than its format.

    Raises:
        KeyError: If an entry is missing.
        ValueError: If an entry is invalid.
    """
    return Ending(
        outcome=Outcome(document["outcome"]),
        reason=read_as(Reason | None, document["reason"]),
        warnings=read_as(tuple[RunWarning, ...], document["warnings"]),
        metrics=_read_metrics(document["metrics"], later),
        counts=read_as(dict[str, int], document["counts"]),
        state_hash=document.get("state_hash", ""),
    )


def _read_metrics(text: str, later: Mapping[str, Any]) -> Metrics:
    if later:
        text = _to_json({**later, **read_as(dict[str, Any], text)})
    return read_as(Metrics, text)


def stop_is_unchanged(stop: Mapping[str, str], documents: bytes) -> bool:
    """Whether the documents of a recording match their hash."""
    ending = {key: value for key, value in stop.items() if key != "documents_hash"}
    return stop.get("documents_hash") == _ending_hash(ending, documents)


def parse_json(text: str | bytes) -> Any:
    """Reads JSON from an untrusted file.

    Raises:
        ValueError: If it is not JSON, or nested deeper than any document of a recording.
    """
    try:
        return json.loads(text, parse_int=_read_integer)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None


def _read_integer(digits: str) -> int | float:
    """An integer; one with too many digits becomes infinite, which is rejected later."""
    return int(digits) if len(digits) <= _MAX_DIGITS else math.inf


def read_as(kind: Any, text: str) -> Any:
    """Converts untrusted JSON to a type.

    Raises:
        ValueError: If it is not JSON of this type, or contains a number that is not finite.
    """
    reader = _reader_of(kind)
    value = reader.validate_python(parse_json(text))
    _check_writable(reader.dump_python(value))
    return value


@cache
def _reader_of(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def _check_writable(value: Any) -> None:
    """Checks that numbers are finite and text has no unpaired surrogates."""
    _to_json(value).encode()


def _to_json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
