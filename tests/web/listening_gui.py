"""A real GUI whose elements a test can read back: what a panel adds is kept in order."""

from __future__ import annotations

from typing import Any, cast

import viser

from slipgrasp.server.viewer.server import ViewerServer


class _ListeningGui:
    def __init__(self, gui: viser.GuiApi) -> None:
        self._gui = gui
        self.texts: list[viser.GuiHtmlHandle] = []
        self.plots: list[viser.GuiUplotHandle] = []

    def add_html(self, *args: Any, **kwargs: Any) -> viser.GuiHtmlHandle:
        self.texts.append(self._gui.add_html(*args, **kwargs))
        return self.texts[-1]

    def add_uplot(self, *args: Any, **kwargs: Any) -> viser.GuiUplotHandle:
        self.plots.append(self._gui.add_uplot(*args, **kwargs))
        return self.plots[-1]

    def __getattr__(self, name: str) -> Any:
        return getattr(self._gui, name)


class ListeningClient:
    """Stands where a viewer does: the GUI of a server, and its atomic blocks."""

    def __init__(self, server: ViewerServer) -> None:
        self._listening = _ListeningGui(server.gui)
        self.atomic = server.atomic

    @property
    def gui(self) -> viser.GuiApi:
        """The GUI, for a panel."""
        return cast("viser.GuiApi", self._listening)

    @property
    def handle(self) -> viser.ClientHandle:
        """The same as a viewer, for a panel."""
        return cast("viser.ClientHandle", self)

    @property
    def texts(self) -> list[str]:
        """All HTML that can be seen, in the order in which it was added."""
        return [text.content for text in self._listening.texts if text.visible]

    @property
    def plots(self) -> list[viser.GuiUplotHandle]:
        """All charts that can be seen, in the order in which they were added."""
        return [plot for plot in self._listening.plots if plot.visible]
