"""The close-ups over a scene as a part of a page that has no server."""

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
    """What to begin the head of viser's page with.

    Args:
        top: Height at the top of the view that is not free, as a share of it.
    """
    folder = resources.files("slipgrasp.web.page")
    files = (f"{module}.js" for module in _MODULES)
    modules = {f"slipgrasp/{file}": _module((folder / file).read_text("utf-8")) for file in files}
    return (
        f'<script type="importmap">{json.dumps({"imports": modules})}</script>'
        f'{colours_html()}<script type="module">{_DRAW.format(top=top)}</script>'
    )


def _module(code: str) -> str:
    """The address of a module that contains itself; it finds others by their names."""
    by_name = code.replace('from "./', 'from "slipgrasp/')
    return f"data:text/javascript;base64,{b64encode(by_name.encode()).decode()}"
