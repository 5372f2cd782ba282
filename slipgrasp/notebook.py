"""Runs in notebooks: a live page as the output of a cell."""

from __future__ import annotations

import io
from collections.abc import Sequence
from html import escape

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Scenario

HEIGHT = 800  # [px]


class ShownPage:
    """A page for notebooks, including those exported to HTML.

    Attributes:
        html: The page, as ``slipgrasp page`` writes it.
        height: Its height in the notebook [px].
    """

    def __init__(self, html: str, height: int) -> None:
        self.html, self.height = html, height

    def _repr_html_(self) -> str:
        """A frame that holds the whole page, so that it needs no server."""
        style = f"width:100%;height:{self.height}px;border:0"
        return f'<iframe title="slipgrasp" style="{style}" srcdoc="{escape(self.html)}"></iframe>'


def show(
    shown: Scenario | RunResult, *, controls: Sequence[str] | None = None, height: int = HEIGHT
) -> ShownPage:
    """Shows a scenario or a run in a notebook, such as Jupyter or marimo, as a live page.

    Args:
        shown: A scenario, which is simulated, or a run.
        controls: Dotted keys of the parameters with sliders; the defaults if None.
        height: Height of the page [px].

    Raises:
        SlipgraspError: If a page cannot simulate the scenario, or a parameter cannot have a slider.
    """
    # The page needs the dashboard, whose import takes seconds.
    from slipgrasp.web.standalone.controls import usual_controls
    from slipgrasp.web.standalone.page_file import write_page

    result = shown if isinstance(shown, RunResult) else simulate(shown)
    stream = io.BytesIO()
    write_page(result, stream, usual_controls(result.scenario) if controls is None else controls)
    return ShownPage(stream.getvalue().decode(), height)
