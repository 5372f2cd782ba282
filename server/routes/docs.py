"""The interactive documentation: one page without external resources, for offline use."""

from __future__ import annotations

from importlib import resources

from fastapi import APIRouter
from starlette.responses import Response

router = APIRouter(include_in_schema=False)

_POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "connect-src 'self'",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'self'",
    )
)


@router.get("/docs")
def show_page() -> Response:
    """Returns the page."""
    return _static("docs.html", "text/html")


@router.get("/docs.js")
def show_script() -> Response:
    """Returns the script of the page."""
    return _static("docs.js", "text/javascript")


@router.get("/docs.css")
def show_style() -> Response:
    """Returns the style sheet of the page."""
    return _static("docs.css", "text/css")


def _static(name: str, media_type: str) -> Response:
    content = (resources.files("slipgrasp.server") / "static" / name).read_bytes()
    return Response(content, media_type=media_type, headers={"Content-Security-Policy": _POLICY})
