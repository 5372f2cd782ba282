"""The card of the tour: what a preset shows, a question, and the knob that answers it."""

from __future__ import annotations

import time
from html import escape

import viser

from slipgrasp.core.run.verdict import scenario_title
from slipgrasp.core.scenario.loading import parameter_definitions
from slipgrasp.web.model.draft import change_time
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.tour import ToggleTour, VisitStop
from slipgrasp.web.model.parameter_groups import Entry
from slipgrasp.web.model.parameter_names import names_of
from slipgrasp.web.model.tour import TOUR, Stop
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.page.markup import click_attribute
from slipgrasp.web.panels.parameter_inputs import Knob, add_knob

_BELOW = 0.5


class TourPanel:
    """Shows the stop of the tour that is on the screen, and nothing outside the tour.

    Args:
        gui: Where it goes.
        place: The tab that it is in.
        send: Takes the intents.
    """

    def __init__(self, gui: viser.GuiApi, place: viser.GuiTabHandle, send: Send) -> None:
        self._gui, self._place, self._send = gui, place, send
        self.card = gui.add_html("", visible=False)
        self.knob: Knob | None = None
        self._shown: Stop | None = None

    def update(self, view: ViewState) -> None:
        """Shows the stop, and the value of its knob that holds at the play head."""
        stop = view.stop
        if stop is not self._shown:
            self._shown = stop
            self._build(stop, view)
        if self.knob is None or self.knob.key == view.editing.key_in_hand(time.monotonic()):
            return
        moment = change_time(view.playback.time) if view.playback else 0.0
        self.knob.show(view.draft.value_at(moment, self.knob.key))

    def remove(self) -> None:
        """Takes everything off the page."""
        self._remove_knob()
        self.card.remove()

    def _build(self, stop: Stop | None, view: ViewState) -> None:
        self._remove_knob()
        self.card.visible = stop is not None
        if stop is None:
            return
        self.card.content = tour_html(TOUR.index(stop), scenario_title(view.draft.base))
        definitions = parameter_definitions(view.draft.base)
        entry = Entry(definitions[stop.knob], names_of(view.draft.base).label(stop.knob))
        with self._place:
            self.knob = add_knob(self._gui, entry, definitions, self._send)
        self.knob.input.order = self.card.order + _BELOW

    def _remove_knob(self) -> None:
        if self.knob is not None:
            self.knob.input.remove()
            self.knob = None


def tour_html(place: int, title: str) -> str:
    """A stop of the tour, with the ways on.

    Args:
        place: Which stop.
        title: What happens in its preset.
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
