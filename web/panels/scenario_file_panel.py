"""Saves the scenario as TOML, and loads scenario files."""

from __future__ import annotations

from html import escape

import viser

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import scenario_to_toml
from slipgrasp.web.model.colours import tone
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.scenario import LoadScenario
from slipgrasp.web.model.view import ViewState

FILE_NAME = "scenario.toml"

_ERRORS_SHOWN = 12


class ScenarioFilePanel:
    """Saves the scenario of the run on the screen, and loads scenarios.

    Args:
        gui: Parent of the widgets.
        send: Accepts the intents.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        with gui.add_folder("Scenario file (TOML)", expand_by_default=False):
            self.save = gui.add_button(
                "Save scenario",
                icon=viser.Icon.FILE_DOWNLOAD,
                disabled=True,
                hint="Download the scenario of the run on the screen, with its timed changes; "
                "`slipgrasp run FILE` and this page can load it.",
            )
            self.load = gui.add_upload_button(
                "Load scenario",
                icon=viser.Icon.FILE_UPLOAD,
                mime_type=".toml",
                hint="Start from a scenario file (TOML, at most 1 MB).",
            )
            self.errors = gui.add_html("")
        self.save.on_click(self._download)
        self.load.on_upload(self._upload)
        self._scenario: Scenario | None = None
        self._told: tuple[FieldError, ...] = ()

    def update(self, view: ViewState) -> None:
        """Shows the errors of the file that was loaded last."""
        self._scenario = view.shown.result.scenario if view.shown else None
        self.save.disabled = self._scenario is None
        if view.editing.file_errors != self._told:
            self._told = view.editing.file_errors
            self.errors.content = file_errors_html(self._told)

    def _download(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        if event.client is not None and self._scenario is not None:
            content = scenario_to_toml(self._scenario).encode()
            event.client.send_file_download(FILE_NAME, content, save_immediately=True)

    async def _upload(self, event: viser.GuiEvent[viser.GuiUploadButtonHandle]) -> None:
        file = event.target.value
        self._send(LoadScenario(file.name, file.content))


def file_errors_html(errors: tuple[FieldError, ...]) -> str:
    """The errors of a file: escaped sentences with their fields."""
    if not errors:
        return ""
    rows = "".join(f"<li>{_error_html(error)}</li>" for error in errors[:_ERRORS_SHOWN])
    left = len(errors) - _ERRORS_SHOWN
    more = f"<li>and {left} more</li>" if left > 0 else ""
    return (
        f"<div role='alert' class='sg-wrong'><b style='color:{tone('bad')}'>Not loaded</b>"
        f"<ul>{rows}{more}</ul></div>"
    )


def _error_html(error: FieldError) -> str:
    field = f"<code>{escape(error.field)}</code>: " if error.field else ""
    limit = ""
    if error.limit and error.limit not in error.message:
        limit = f" <span style='opacity:0.75'>Allowed: {escape(error.limit)}.</span>"
    return field + escape(error.message) + limit
