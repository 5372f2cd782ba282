"""Tab of all laws, whose runs are simulated and drawn only while it is visible."""

from __future__ import annotations

import viser

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.custom_laws import LAW, law_names
from slipgrasp.core.scenario.knowledge import knowledge_of
from slipgrasp.core.words.knowledge_words import describe_comparison
from slipgrasp.web.charts.html import note_html
from slipgrasp.web.charts.law_charts import LAWS_TAB, law_charts_html, laws_html
from slipgrasp.web.model.intents.picture import SeeCharts
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.page.markup import visible_attribute

_SENTINEL = f"<div {visible_attribute(SeeCharts, tab=LAWS_TAB)} style='height:1px'></div>"
_ABOUT = (
    "The scenario with every law and its recommended settings. A click uses the law for the whole "
    "run; it can be undone."
)


_NO_HAND = "Control laws need a hand, but this scenario has none; choose another scenario."


class LawsTab:
    """Draws overlaid runs with every law.

    Args:
        gui: Parent of the widgets.
        tab: The tab.
    """

    def __init__(self, gui: viser.GuiApi, tab: viser.GuiTabHandle) -> None:
        self._drawn: object = None
        with tab:
            gui.add_html(_SENTINEL)
            self._note = gui.add_html("")
            self._buttons = gui.add_html("")
            self._pictures = gui.add_html("")

    def update(self, view: ViewState) -> None:
        """Draws the runs while the tab is visible."""
        if view.shown is None or view.playback is None or LAWS_TAB not in view.charts.seen:
            return
        if not view.shown.result.scenario.space.has_hand:
            self._note.content = note_html([_NO_HAND])
            self._buttons.content = self._pictures.content = ""
            self._drawn = None
            return
        dark, window = view.appearance.dark, view.playback.window
        present, runs = view.shown.result.scenario.controller.kind, view.laws.runs
        drawing = (runs, window, present, dark)
        if drawing == self._drawn:
            return
        self._drawn = drawing
        known = known_words(view.shown.result.scenario)
        self._note.content = note_html([_ABOUT, known] if runs else ["Running every law …"])
        self._buttons.content = laws_html(runs, present, dark=dark)
        self._pictures.content = law_charts_html(runs, window, dark=dark) if runs else ""


def known_words(scenario: Scenario) -> str:
    """The known parameters of all laws in a scenario."""
    known = knowledge_of(scenario, {LAW: law_names()})
    return describe_comparison(scenario, known, "comparison")
