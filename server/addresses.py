"""Where the REST interface has what: paths below the port of the server."""

from __future__ import annotations

API_PATH = "/api/v1"
DOCS_PATH = f"{API_PATH}/docs"
UPLOAD_PATH = f"{API_PATH}/recordings"
STUDIES_PATH = f"{API_PATH}/studies"
ESTIMATE_PATH = f"{STUDIES_PATH}/estimate"
SESSIONS_PATH = "/dashboard/sessions"


def preset_path(name: str) -> str:
    """Where a preset is found."""
    return f"{API_PATH}/presets/{name}"


def run_path(run_id: str) -> str:
    """Where a run is found."""
    return f"{API_PATH}/runs/{run_id}"


def study_path(study_id: str) -> str:
    """Where a study is found."""
    return f"{STUDIES_PATH}/{study_id}"
