"""Security headers of every response."""

from __future__ import annotations

from collections.abc import Mapping

RESOURCE_CONTENT_POLICY = "default-src 'none'; frame-ancestors 'self'"
"""For everything that is not a page: nothing in it may run or load."""

SAFE_HEADERS: Mapping[str, str] = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}
"""An answer is what it says it is, its address goes to nobody, and no other page gets it."""
