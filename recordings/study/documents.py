"""Documents at the start and end of a study's file: its definition and its end."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Literal

from mcap.records import Schema

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.provenance import present_provenance
from slipgrasp.core.scenario.custom_laws import LawIdentity
from slipgrasp.core.scenario.loading import all_preset_names, scenario_from_mapping
from slipgrasp.core.study.definition import Study
from slipgrasp.core.study.loading import study_from_mapping, study_to_mapping
from slipgrasp.recordings.file.container import McapContainer
from slipgrasp.recordings.file.documents import parse_json, read_as
from slipgrasp.recordings.study.study_row import row_schema

STUDY_FORMAT = 1
STUDY_START = "slipgrasp/study/start"
STUDY_STOP = "slipgrasp/study/stop"
DEFINITION = "study.json"
LAWS = "laws"
TOPIC = "/slipgrasp/study/runs"
CHANNEL = 1

State = Literal["completed", "cancelled", "failed"]


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyEnd:
    """End of a study.

    Attributes:
        state: ``completed`` if every run has a result, else why it ended early.
        runs: Number of results.
        outcomes: Number of runs by outcome.
        message: Further message in a sentence; usually empty.
    """

    state: State
    runs: int
    outcomes: dict[str, int]
    message: str = ""


def start_document(study: Study) -> dict[str, str]:
    """Versions of format and program, the kernel, its laws, and the description of a study."""
    provenance = present_provenance(study.base.space)
    laws = [asdict(law.identity) for law in study.custom_laws()]
    return {
        "format": str(STUDY_FORMAT),
        "program": provenance.program,
        "kernel": provenance.kernel,
        "base": study.base_name,
        "runs": str(study.num_runs),
        "keys": json.dumps(study.keys),
        "recordings": study.recordings,
        **({LAWS: json.dumps(laws)} if laws else {}),
    }


def definition_document(study: Study) -> bytes:
    """The whole study as JSON: base, variation and stored recordings."""
    return json.dumps(study_to_mapping(study), ensure_ascii=False, indent=1).encode()


def read_definition(document: bytes, start: Mapping[str, str]) -> Study:
    """Creates the study from its document, and validates it.

    Raises:
        ValueError: If it is not valid.
    """
    try:
        study = study_from_mapping(
            parse_json(document), partial(scenario_from_mapping, with_law=False)
        )
    except ScenarioError as error:
        raise ValueError(str(error)) from error
    name = start.get("base", "")
    return replace(
        study,
        base_name=name if name in all_preset_names() else "",
        computed_by=_read_laws(start.get(LAWS, "[]")),
    )


def _read_laws(text: str) -> tuple[LawIdentity, ...]:
    try:
        return read_as(tuple[LawIdentity, ...], text)
    except ValueError as error:
        raise ValueError("the laws in its start document are malformed") from error


def stop_document(end: StudyEnd, rows_hash: str) -> dict[str, str]:
    """The end of the study, and the hash of all its results."""
    return {"end": json.dumps(asdict(end), ensure_ascii=False), "rows_hash": rows_hash}


def read_end(document: Mapping[str, str]) -> StudyEnd:
    """Reads the document of `stop_document`.

    Raises:
        KeyError: If an entry is missing.
        ValueError: If an entry is invalid.
    """
    return read_as(StudyEnd, document["end"])


def add_rows_topic(container: McapContainer) -> None:
    """Adds the topic of the results; the time of a message is the index of its run [ns].

    Programs that read JSON in MCAP can show them.
    """
    data = json.dumps(row_schema()).encode()
    schema = Schema(id=CHANNEL, name="slipgrasp.StudyRow", encoding="jsonschema", data=data)
    container.add_topic(TOPIC, schema, {"log_time": "index of the run, not a time"})
