"""What is put into the head of viser's page."""

from __future__ import annotations

from slipgrasp.web.page.keys import keys_html
from slipgrasp.web.page.static_files import STATIC_PATH


def head_html() -> str:
    """Our style and our script, and what the script has to know from the start."""
    return (
        f'<link rel="stylesheet" href="{STATIC_PATH}/dashboard.css" />'
        f"{keys_html()}"
        f'<script type="module" src="{STATIC_PATH}/dashboard.js"></script>'
    )
