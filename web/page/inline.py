"""Close-ups in a page without a server."""

from __future__ import annotations

import json
from base64 import b64encode
from importlib import resources

from slipgrasp.web.page.colours import colours_html

_MODULES = ("close_up", "close_up_places", "contact_run", "overlay", "projection", "viser_view")
_DRAW = """import {{ drawCloseUps }} from "slipgrasp/viser_view.js";
(function draw() {{
  drawCloseUps({{ top: {top} * innerHeight, bottom: 0 }});
  requestAnimationFrame(draw);
}})();"""


def close_ups_html(top: float) -> str:
    """HTML for the head of viser's page.

    Args:
        top: Reserved fraction of the height at the top of the view.
    """
    folder = resources.files("slipgrasp.web.page")
    files = (f"{module}.js" for module in _MODULES)
    modules = {f"slipgrasp/{file}": _module((folder / file).read_text("utf-8")) for file in files}
    return (
        f'<script type="importmap">{json.dumps({"imports": modules})}</script>'
        f'{colours_html()}<script type="module">{_DRAW.format(top=top)}</script>'
    )


def _module(code: str) -> str:
    """A URL that contains a module; other modules are found by name."""
    by_name = code.replace('from "./', 'from "slipgrasp/')
    return f"data:text/javascript;base64,{b64encode(by_name.encode()).decode()}"
