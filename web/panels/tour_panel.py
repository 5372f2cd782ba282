"""The card of the tour: title of a preset, a question, and the control to answer it."""

from __future__ import annotations

import time
from html import escape

import viser

from slipgrasp.core.run.verdict import scenario_title
from slipgrasp.core.scenario.loading import parameter_definitions
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.tour import ToggleTour, VisitStop
from slipgrasp.web.model.parameter_groups import Entry
from slipgrasp.web.model.parameter_names import names_of
from slipgrasp.web.model.tour import TOUR, Stop
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.page.markup import click_attribute
from slipgrasp.web.panels.parameter_inputs import Control, add_control

_BELOW = 0.5


class TourPanel:
    """Shows the current stop of the tour; empty outside the tour.

    Args:
        gui: Parent of the widgets.
        place: Tab of the card.
        send: Accepts the intents.
    """

    def __init__(self, gui: viser.GuiApi, place: viser.GuiTabHandle, send: Send) -> None:
        self._gui, self._place, self._send = gui, place, send
        self.card = gui.add_html("", visible=False)
        self.control: Control | None = None
        self._shown: Stop | None = None

    def update(self, view: ViewState) -> None:
        """Shows the stop, and the value of its control at the play head."""
        stop = view.stop
        if stop is not self._shown:
            self._shown = stop
            self._build(stop, view)
        if self.control is None or self.control.key == view.editing.key_in_hand(time.monotonic()):
            return
        moment = view.moment
        self.control.show(view.draft.value_at(moment, self.control.key))

    def _build(self, stop: Stop | None, view: ViewState) -> None:
        self._remove_control()
        self.card.visible = stop is not None
        if stop is None:
            return
        self.card.content = tour_html(TOUR.index(stop), scenario_title(view.draft.base))
        definitions = parameter_definitions(view.draft.base)
        entry = Entry(definitions[stop.control], names_of(view.draft.base).label(stop.control))
        with self._place:
            self.control = add_control(self._gui, entry, definitions, self._send)
        self.control.input.order = self.card.order + _BELOW

    def _remove_control(self) -> None:
        if self.control is not None:
            self.control.input.remove()
            self.control = None


def tour_html(place: int, title: str) -> str:
    """A stop of the tour, with navigation.

    Args:
        place: Index of the stop.
        title: Title of its preset.
    """
    stop = TOUR[place]
    ways = "".join(
        f"<button type='button' class='sg-try' {click_attribute(intent)}>{word}</button>"
        for word, intent, is_open in (
            ("Back", VisitStop(max(place - 1, 0)), place > 0),
            ("Next", VisitStop(place + 1), place + 1 < len(TOUR)),
            ("Leave", ToggleTour(), True),
        )
        if is_open
    )
    return (
        "<section class='sg-tour' aria-label='Tour'>"
        f"<div class='sg-tries'><b>Tour, {place + 1} of {len(TOUR)}: {escape(stop.preset)}</b>"
        f"{ways}</div><p>{escape(title)}</p><p><b>{escape(stop.question)}</b></p></section>"
    )
