"""Security headers of every response."""

from __future__ import annotations

from collections.abc import Mapping

RESOURCE_CONTENT_POLICY = "default-src 'none'; frame-ancestors 'self'"
"""Policy of all responses other than pages: nothing in them can be executed or loaded."""

SAFE_HEADERS: Mapping[str, str] = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
}
"""Prevents content sniffing, referrers, and use by other pages."""
