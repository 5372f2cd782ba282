"""Colours of the overlay of the view, for a light and a dark page."""

from __future__ import annotations

import json

from slipgrasp.recordings.palette import CONE, PHASES, WATER
from slipgrasp.web.model.colours import BELIEVED_CONE, CONE_INSIDE, css
from slipgrasp.web.model.surfaces import surfaces_for


def colours_html() -> str:
    """The table as an HTML element for the script."""
    table = {
        "phases": {str(int(phase)): css(colour) for phase, colour in PHASES.items()},
        "cone": css(CONE),
        "estimated": css(BELIEVED_CONE),
        "inside": css(CONE_INSIDE),
        "light": _surfaces(dark=False),
        "dark": _surfaces(dark=True),
    }
    return f'<script type="application/json" id="sg-colours">{json.dumps(table)}</script>'


def _surfaces(*, dark: bool) -> dict[str, str]:
    """Colours by their names in overlay.js."""
    surfaces = surfaces_for(dark=dark)
    colours = {
        "ink": surfaces.ink,
        "page": surfaces.page,
        "lens": surfaces.lens,
        "object": surfaces.object,
        "edge": surfaces.object_edge,
        "link": surfaces.link,
        "joint": surfaces.joint,
        "leader": surfaces.leader,
        "ghost": surfaces.pale_edge,
        "water": WATER,
    }
    return {name: css(colour) for name, colour in colours.items()}
