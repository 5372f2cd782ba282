"""All exports in one panel."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from html import escape

import viser

from slipgrasp.recordings.export import MOVING_FORMATS, STILL_FORMATS
from slipgrasp.recordings.still import AT_THE_END, LEAST_SIDE, MOST_SIDE
from slipgrasp.server.addresses import API_PATH, from_page
from slipgrasp.web.model.colours import tone
from slipgrasp.web.model.export import Exporting
from slipgrasp.web.model.intents.export import (
    CancelExport,
    ExportCharts,
    ExportClip,
    ExportPage,
    ExportPicture,
    ExportStill,
)
from slipgrasp.web.model.intents.intent import Intent, Send
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.panels.session_state_panel import linked_run

_BUTTONS: tuple[tuple[str, viser.IconName, str, type[Intent]], ...] = (
    (
        "View (PNG)",
        viser.Icon.PHOTO,
        "Saves the current view of the scene as an image.",
        ExportPicture,
    ),
    (
        "Charts (SVG)",
        viser.Icon.CHART_LINE,
        "Saves all charts as shown, with time range, visible lines and ghost.",
        ExportCharts,
    ),
    (
        "Page (HTML)",
        viser.Icon.BROWSER,
        "Saves one file that simulates this scenario in any browser, offline, with sliders.",
        ExportPage,
    ),
)
_CLIP = "Saves the visible time range, at the current playback speed, as "
_HEIGHTS = ("480", "720", "1080")


class ExportPanel:
    """Panel with the exports of the run on the screen.

    Args:
        gui: Parent of the widgets.
        send: Accepts the intents.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        with gui.add_folder("Export", expand_by_default=False):
            self._gui, self._send = gui, send
            self._buttons: list[viser.GuiButtonHandle] = []
            for label, icon, hint, intent in _BUTTONS:
                self._add_button(label, icon, hint, intent)
            for form in STILL_FORMATS:
                hint = (
                    f"Draws the instant at the play head as {form.contents}, with the width "
                    "and height below."
                )
                still = partial(self._still, form.name)
                self._add_button(f"Still ({form.title})", viser.Icon.PHOTO_STAR, hint, still)
            self._sides = [
                gui.add_number(
                    f"still {side} [px]",
                    initial_value=usual,
                    min=LEAST_SIDE,
                    max=MOST_SIDE,
                    step=1,
                    hint=f"{side.capitalize()} of a still.",
                )
                for side, usual in (("width", AT_THE_END.width), ("height", AT_THE_END.height))
            ]
            for form in (each for each in MOVING_FORMATS if each.is_installed):
                hint, clip = f"{_CLIP}{form.contents}.", partial(self._clip, form.name)
                self._add_button(f"Clip ({form.title})", viser.Icon.MOVIE, hint, clip)
            self._height = gui.add_dropdown(
                "clip height [px]",
                _HEIGHTS,
                initial_value="720",
                hint="Height of a GIF, MP4 or WebM; MP4 and WebM need the extra 'film'.",
            )
            self._bar = gui.add_progress_bar(0.0, visible=False)
            self._cancel = gui.add_button(
                "Cancel", icon=viser.Icon.X, hint="Cancels the export.", visible=False
            )
            self._cancel.on_click(lambda _: send(CancelExport()))
            self._words = gui.add_html("")
            self._picture = gui.add_html(picture_html(Exporting()))
        self._drawn: tuple[bool, str, Exporting] | None = None

    def _add_button(
        self, label: str, icon: viser.IconName, hint: str, intent: Callable[[], Intent]
    ) -> None:
        button = self._gui.add_button(label, icon=icon, hint=hint, disabled=True)
        button.on_click(lambda _: self._send(intent()))
        self._buttons.append(button)

    def _clip(self, name: str) -> ExportClip:
        return ExportClip(name, int(self._height.value))

    def _still(self, name: str) -> ExportStill:
        width, height = (int(side.value) for side in self._sides)
        return ExportStill(name, width, height)

    def update(self, view: ViewState) -> None:
        """Shows the available exports, and the progress."""
        drawing = (view.shown is not None, linked_run(view), view.exporting)
        if drawing == self._drawn:
            return
        self._drawn = drawing
        is_shown, run_id, exporting = drawing
        is_busy = bool(exporting.busy_with)
        for button in self._buttons:
            button.disabled = is_busy or not is_shown
        self._bar.visible = self._cancel.visible = is_busy
        self._bar.value = 100.0 * exporting.share
        self._words.content = export_html(exporting, run_id)
        self._picture.content = picture_html(exporting)


def export_html(exporting: Exporting, run_id: str) -> str:
    """Progress and result of an export, and files on the server.

    Args:
        exporting: State of the export.
        run_id: Id of the stored run; empty if it is not stored.
    """
    words = f"{exporting.busy_with} …" if exporting.busy_with else exporting.message
    colour = f"color:{tone('bad')}" if exporting.is_failure else ""
    lines = [f"<div role='status' style='{colour}'>{escape(words)}</div>"] if words else []
    if run_id:
        run = f"{from_page(API_PATH)}/runs/{escape(run_id)}"
        lines.append(
            f"<div>Stored files: <a href='{run}/recording' download>recording (MCAP)</a>, "
            f"<a href='{run}/signals.csv' download>signals (CSV)</a></div>"
        )
    else:
        lines.append(
            "<div>Recording (MCAP) and signals (CSV) are available once the run is saved.</div>"
        )
    return f"<div style='padding:0.3em 1em;font-size:0.85em;line-height:1.4'>{''.join(lines)}</div>"


def picture_html(exporting: Exporting) -> str:
    """A hidden element that requests an image of the scene from the page's script."""
    return (
        f"<i hidden data-sg-picture='{exporting.pictures}'"
        f" data-sg-name='{escape(exporting.picture_name)}'></i>"
    )
