"""The files of the page that are served as they are."""

from __future__ import annotations

from functools import cache
from importlib import resources

STATIC_PATH = "/dashboard/static"

_MEDIA_TYPES = {".js": "text/javascript", ".css": "text/css"}


def static_file(name: str) -> tuple[bytes, str] | None:
    """The content of a file and its media type; None if there is none of that name."""
    return _static_files().get(name)


@cache
def _static_files() -> dict[str, tuple[bytes, str]]:
    return {
        file.name: (file.read_bytes(), media_type)
        for file in resources.files("slipgrasp.web.page").iterdir()
        for suffix, media_type in _MEDIA_TYPES.items()
        if file.name.endswith(suffix)
    }
