"""The inputs of the study panel: variations, and the run to open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import viser

from slipgrasp.core.study.definition import Axis, Study
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.study import ChooseAxis, ChooseComparison, OpenStudyRun, SetRange
from slipgrasp.web.model.parameter_names import names_of
from slipgrasp.web.model.study import StudyView
from slipgrasp.web.model.study_draft import (
    MAX_STEPS,
    MIN_STEPS,
    NO_COMPARISON,
    AxisDraft,
    Offer,
    comparisons_for,
)
from slipgrasp.web.model.study_words import value_words

_UNKNOWN: tuple[str, ...] = ("…",)
_NO_COMPARISON: tuple[str, ...] = (NO_COMPARISON,)
_FINEST = 1e-4
MAX_CHOSEN_AXES = 4
"""Runs of studies with more combinations are selected by index."""


class DraftInputs:
    """Inputs of two parameters, their ranges, and the compared setting.

    Args:
        gui: Parent of the widgets.
        send: Accepts the intents.

    Attributes:
        axes: The inputs of both parameters.
        comparison: The compared setting.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._send = send
        self.axes = (
            _AxisInputs(gui, 0, "across", "Varies along the horizontal axis of the map.", send),
            _AxisInputs(gui, 1, "upwards", "Varies along the vertical axis of the map.", send),
        )
        self.comparison = gui.add_dropdown(
            "compare",
            _NO_COMPARISON,
            hint="Tries settings of the controller on the same values, with everything else equal: "
            "one map for each.",
        )
        self.comparison.on_update(self._compare)

    def show(self, study: StudyView) -> None:
        """Shows the draft."""
        draft = study.draft
        if draft is None:
            return
        for axis, inputs in zip(draft.axes, self.axes, strict=True):
            inputs.show(axis, study.offers)
        offered = comparisons_for(draft, study.compared)
        _set_options(self.comparison, offered, draft.comparison)
        self.comparison.visible = bool(study.compared)

    def remove(self) -> None:
        """Removes all widgets."""
        for element in (*self.axes, self.comparison):
            element.remove()

    async def _compare(self, event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
        if event.client_id is not None:
            self._send(ChooseComparison(event.target.value))


class _AxisInputs:
    """One of the two parameters: key, range, and number of values.

    Args:
        gui: Parent of the widgets.
        place: 0 horizontal, 1 vertical.
        label: Name of the axis.
        hint: Description in a sentence.
        send: Accepts the intents.
    """

    def __init__(self, gui: viser.GuiApi, place: int, label: str, hint: str, send: Send) -> None:
        self._place, self._hint, self._send = place, hint, send
        self._offers: tuple[Offer, ...] = ()
        self._axis: AxisDraft | None = None
        self.key = gui.add_dropdown(label, _UNKNOWN, hint=hint)
        self.range = gui.add_vector2(
            "from, to",
            (0.0, 1.0),
            step=_FINEST,
            hint="First and last value, in the unit of the parameter.",
        )
        self.count = gui.add_slider(
            "values",
            MIN_STEPS,
            MAX_STEPS,
            1,
            MIN_STEPS,
            hint="Number of values, including first and last; the numbers of both axes multiply.",
        )
        self.is_log = gui.add_checkbox(
            "equal ratios",
            False,
            hint="Spaces the values logarithmically; the first must be above 0.",
        )
        self.key.on_update(self._choose)
        for widget in (self.range, self.count, self.is_log):
            widget.on_update(self._set)

    def show(self, axis: AxisDraft, offers: tuple[Offer, ...]) -> None:
        """Shows the draft of the axis."""
        self._axis, self._offers = axis, offers
        offer = next(offer for offer in offers if offer.key == axis.key)
        _set_options(self.key, [offer.label for offer in offers], offer.label)
        self.key.hint = f"{self._hint} {offer.text}"
        _set(self.range, (axis.low, axis.high))
        _set(self.count, axis.count)
        _set(self.is_log, axis.is_log)

    def remove(self) -> None:
        """Removes all widgets."""
        for element in (self.key, self.range, self.count, self.is_log):
            element.remove()

    async def _choose(self, event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
        # Runs in the viewer server's event loop, which preserves the order of events.
        offer = next((o for o in self._offers if o.label == event.target.value), None)
        if event.client_id is not None and offer is not None:
            self._send(ChooseAxis(self._place, offer.key))

    async def _set(self, event: viser.GuiEvent[Any]) -> None:
        if event.client_id is not None and self._axis is not None:
            low, high = self.range.value
            count, is_log = self.count.value, self.is_log.value
            axis = AxisDraft(self._axis.key, low, high, int(count), is_log)
            self._send(SetRange(self._place, axis))


class StudyRunInputs:
    """Selection of a run of a study by its values, or by its index, without a mouse.

    Args:
        gui: Parent of the widgets.
        send: Accepts the intents.

    Attributes:
        values: One list of values per varied parameter; empty for studies other than grids.
        number: Index of the run.
        open: Opens it.
    """

    def __init__(self, gui: viser.GuiApi, send: Send) -> None:
        self._gui, self._send = gui, send
        self._study: Study | None = None
        self._levels: list[list[str]] = []
        self.values = tuple(
            gui.add_dropdown(f"value {place + 1}", _UNKNOWN, visible=False, hint="Chooses a run.")
            for place in range(MAX_CHOSEN_AXES)
        )
        self.number = gui.add_number(
            "run", 0, min=0, step=1, hint="Index of the run in the study, from 0."
        )
        self.open = gui.add_button(
            "Open this run",
            icon=viser.Icon.PLAYER_PLAY,
            hint="Simulates this run again, checks it against the study and shows it.",
        )
        for widget in self.values:
            widget.on_update(self._choose)
        self.open.on_click(self._open)

    def show(self, study: Study, index: int | None) -> None:
        """Lists the runs of a study.

        Args:
            study: The study.
            index: The run that was requested last, if any.
        """
        if study is not self._study:
            self._study = study
            self._offer(study)
            index = index or 0
        if index is not None and index != self.number.value:
            _set(self.number, index)
        if index is not None and self._levels:
            for widget, options, place in zip(
                self.values, self._levels, _places(study, index), strict=False
            ):
                _set(widget, options[place])

    def set_visible(self, is_visible: bool) -> None:
        """Shows or hides all of it."""
        for place, widget in enumerate(self.values):
            widget.visible = is_visible and place < len(self._levels)
        self.number.visible = is_visible and not self._levels
        self.open.visible = is_visible

    def remove(self) -> None:
        """Removes all widgets."""
        for element in (*self.values, self.number, self.open):
            element.remove()

    def _offer(self, study: Study) -> None:
        axes = study.crossed_axes if not study.sampled_axes and not study.listed else ()
        names = names_of(study.base)
        self._levels = []
        for widget, axis in zip(
            self.values, axes if len(axes) <= MAX_CHOSEN_AXES else (), strict=False
        ):
            options = _level_words(axis)
            widget.label = names.label(axis.key)
            widget.hint = "Chooses one of the values that the study tried."
            _set_options(widget, options, options[0])
            self._levels.append(options)
        self.number.max = study.num_runs - 1

    async def _choose(self, event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
        if event.client_id is not None and self._study is not None and self._levels:
            places = [
                options.index(widget.value)
                for widget, options in zip(self.values, self._levels, strict=False)
            ]
            self.number.value = run_of_places(self._study, places)

    async def _open(self, _: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        self._send(OpenStudyRun(int(self.number.value)))


def run_of_places(study: Study, places: Sequence[int]) -> int:
    """The run of a grid at given indices of its axes; the last axis varies fastest."""
    sizes = [axis.grid_size for axis in study.crossed_axes]
    return int(np.ravel_multi_index(tuple(places), sizes))


def _places(study: Study, index: int) -> list[int]:
    """The inverse of `run_of_places`."""
    sizes = [axis.grid_size for axis in study.crossed_axes]
    return [int(place) for place in np.unravel_index(index, sizes)]


def _level_words(axis: Axis) -> list[str]:
    """The values of an axis as distinct text."""
    values = [axis.grid_value(place) for place in range(axis.grid_size)]
    words = [value_words(value) for value in values]
    if len(set(words)) < len(words):
        words = [f"{place + 1}: {text}" for place, text in enumerate(words)]
    return words


def _set_options(widget: viser.GuiDropdownHandle[str], options: Sequence[str], value: str) -> None:
    """Sets the options and value of a list, only if they changed."""
    if tuple(widget.options) != tuple(options):
        widget.options = tuple(options)
    _set(widget, value)


def _set(widget: Any, value: Any) -> None:
    if widget.value != value:
        widget.value = value
