"""Where the server has what: paths below its port, and how those outside write them."""

from __future__ import annotations

from contextvars import ContextVar

API_PATH = "/api/v1"
DASHBOARD_PATH = "/dashboard"
DOCS_PATH = f"{API_PATH}/docs"
UPLOAD_PATH = f"{API_PATH}/recordings"
STUDIES_PATH = f"{API_PATH}/studies"
FITS_PATH = f"{API_PATH}/fits"
ESTIMATE_PATH = f"{STUDIES_PATH}/estimate"
SESSIONS_PATH = f"{DASHBOARD_PATH}/sessions"

root_path: ContextVar[str] = ContextVar("root_path", default="")
"""Path at which a proxy shows the server that answers the request at hand; mostly empty."""


def from_outside(path: str) -> str:
    """A path of the server as those write it who send the request at hand."""
    return f"{root_path.get()}{path}"


def from_page(path: str) -> str:
    """A path of the server as links in the dashboard write it: from there, wherever that is."""
    return path.removeprefix("/")


def preset_path(name: str) -> str:
    """Where a preset is found."""
    return from_outside(f"{API_PATH}/presets/{name}")


def run_path(run_id: str) -> str:
    """Where a run is found."""
    return from_outside(f"{API_PATH}/runs/{run_id}")


def study_path(study_id: str) -> str:
    """Where a study is found."""
    return from_outside(f"{STUDIES_PATH}/{study_id}")


def fit_path(fit_id: str) -> str:
    """Where a fit is found."""
    return from_outside(f"{FITS_PATH}/{fit_id}")
