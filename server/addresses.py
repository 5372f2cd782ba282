"""Paths of the server, and their public form behind a proxy."""

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
"""Root path of the proxy of the current request; usually empty."""


def from_outside(path: str) -> str:
    """A path of the server as the sender of the request must write it."""
    return f"{root_path.get()}{path}"


def from_page(path: str) -> str:
    """A path of the server as a relative link in the dashboard."""
    return path.removeprefix("/")


def preset_path(name: str) -> str:
    """Path of a preset."""
    return from_outside(f"{API_PATH}/presets/{name}")


def run_path(run_id: str) -> str:
    """Path of a run."""
    return from_outside(f"{API_PATH}/runs/{run_id}")


def study_path(study_id: str) -> str:
    """Path of a study."""
    return from_outside(f"{STUDIES_PATH}/{study_id}")


def fit_path(fit_id: str) -> str:
    """Path of a fit."""
    return from_outside(f"{FITS_PATH}/{fit_id}")
