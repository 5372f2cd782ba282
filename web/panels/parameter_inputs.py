"""Creates controls from the definitions of parameters."""

from __future__ import annotations

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import viser

from slipgrasp.core.scenario.parameters import Parameter
from slipgrasp.web.model.disturbances import is_of_disturbance
from slipgrasp.web.model.draft import Value
from slipgrasp.web.model.intents.intent import Send
from slipgrasp.web.model.intents.scenario import SetParameter
from slipgrasp.web.model.parameter_groups import Entry
from slipgrasp.web.model.row_text import numbers_of, parse_rows, row_parameters
from slipgrasp.web.model.slider_range import round_step, slider_range

Input = (
    viser.GuiSliderHandle[float]
    | viser.GuiNumberHandle[float]
    | viser.GuiNumberHandle[int]
    | viser.GuiDropdownHandle[str]
    | viser.GuiCheckboxHandle
    | viser.GuiTextHandle
)

_BEYOND = " The field also accepts values beyond the ends of the slider, and widens it."
# Delay until the page has applied the wider range of a slider [s].
_WIDENING = 2.0
# Decimals of a field, enough for any typed number.
_DECIMALS = 12


class Control(ABC):
    """The input of one parameter, which sends intents.

    Attributes:
        key: The parameter.
        input: The widget.
    """

    def __init__(self, parameter: Parameter, widget: Input, send: Send) -> None:
        self.key, self.input = parameter.key, widget
        self._parameter, self._send = parameter, send
        self._is_used = True
        widget.on_update(self._moved)

    @property
    def value(self) -> Any:
        """The value of the widget, as shown."""
        return self.input.value

    @abstractmethod
    def show(self, value: object) -> None:
        """Shows a value."""

    def use(self, is_used: bool) -> None:
        """Hides the widget while its parameter is not used."""
        self._is_used = is_used
        self.input.visible = is_used and self._fits

    @property
    def _fits(self) -> bool:
        """Whether the widget can represent a value."""
        return True

    def read(self, value: Any) -> Value:
        """The meaning of the widget's value."""
        return value

    # In the viewer server's event loop, which preserves the order of a drag.
    async def _moved(self, event: viser.GuiEvent[Any]) -> None:
        # Values that the program sets have no client, and are ignored.
        if event.client_id is not None:
            self._send(SetParameter(self.key, self.read(event.target.value)))


class _Outgrown(NamedTuple):
    """A typed number, and the limits of the slider that it exceeds.

    If the user leaves a field before the page has applied the wider range of the slider, the page
    clips the number to the old limit.
    """

    number: float = math.nan
    limits: tuple[float, ...] = ()
    until: float = -math.inf

    def by(self, number: float, limit: float, now: float) -> _Outgrown:
        """Updates a number that exceeds a limit, possibly with its next digit."""
        before = self.limits if now < self.until else ()
        return _Outgrown(number, (*before, limit), now + _WIDENING)

    def cuts_off(self, number: float, now: float) -> bool:
        """Whether the page, not the user, has changed the number to this value."""
        return now < self.until and number in self.limits


class _SliderControl(Control):
    """A slider with a field that accepts any number exactly."""

    input: viser.GuiSliderHandle[float]

    def __init__(
        self,
        parameter: Parameter,
        definitions: Mapping[str, Parameter],
        widget: viser.GuiSliderHandle[float],
        send: Send,
    ) -> None:
        super().__init__(parameter, widget, send)
        self._definitions = definitions
        self._outgrown = _Outgrown()
        self._is_single = widget.visible
        # Otherwise the field would round typed numbers to the steps of the slider.
        widget.precision = _DECIMALS

    def show(self, value: object) -> None:
        """Shows a number; a list is shown in a text field instead."""
        self._is_single = not isinstance(value, (list, tuple))
        self.use(self._is_used)
        if isinstance(value, (float, int)) and math.isfinite(value):
            low, high, _ = slider_range(self._parameter, self._definitions, value)
            self._span(low, high)
            self.input.value = value

    def read(self, value: Any) -> Value:
        """The number; one outside the slider widens it, so that the field does not clip it."""
        number, now = float(value), time.monotonic()
        if self._outgrown.cuts_off(number, now):
            self.input.value = self._outgrown.number
            return self._outgrown.number
        low, high = self.input.min, self.input.max
        if math.isfinite(number) and not low <= number <= high:
            self._outgrown = self._outgrown.by(number, low if number < low else high, now)
            self._span(min(low, number), max(high, number))
        elif math.isfinite(number) and not (self._allows(low) and self._allows(high)):
            # It was widened for an invalid number, which this one has replaced.
            low, high, _ = slider_range(self._parameter, self._definitions, number)
            self._span(low, high)
        return number

    def _allows(self, number: float) -> bool:
        """Whether a number is within the bounds of the parameter."""
        least, most = self._parameter.minimum, self._parameter.maximum
        return (least is None or number >= least) and (most is None or number <= most)

    @property
    def _fits(self) -> bool:
        """Whether a slider can show the value: a number, not a list."""
        return self._is_single

    def _span(self, low: float, high: float) -> None:
        if low != self.input.min:
            self.input.min = low
        if high != self.input.max:
            self.input.max = high


class _PlainControl(Control):
    """A number, a choice, or yes and no."""

    def show(self, value: Any) -> None:
        """Shows the value."""
        if self.input.value != value:
            self.input.value = value

    def read(self, value: Any) -> Value:
        """The value; an integer if its parameter is one."""
        return int(value) if self._parameter.kind == "integer" and value == int(value) else value


class _TextControl(Control):
    """A text, a list of numbers, or an optional number."""

    input: viser.GuiTextHandle

    def show(self, value: object) -> None:
        """Shows the value; an equivalent notation by the user is kept."""
        if self.read(self.input.value) != value:
            self.input.value = as_text(value)

    def read(self, value: Any) -> Value:
        """The text, or the numbers in it."""
        return value if self._parameter.kind == "text" else parse_text(value)


class _RowsControl(Control):
    """A list of rows of numbers, separated by semicolons."""

    input: viser.GuiTextHandle

    def show(self, value: object) -> None:
        """Shows the rows; an equivalent notation by the user is kept."""
        if self.read(self.input.value) != value:
            is_list = isinstance(value, list)
            rows = [as_text(numbers_of(row)) for row in value] if is_list else [as_text(value)]
            self.input.value = "; ".join(rows)

    def read(self, value: Any) -> Value:
        """The rows, or the text itself if it is invalid."""
        return parse_rows(self.key, value)


def add_control(
    gui: viser.GuiApi, entry: Entry, definitions: Mapping[str, Parameter], send: Send
) -> Control:
    """Adds the input of one parameter.

    Args:
        gui: Parent of the widgets.
        entry: The parameter, with initial value and label.
        definitions: Every parameter of the scenario by key.
        send: Accepts the intents.
    """
    entry = replace(entry, label=_unbroken(entry.label))
    parameter, label, hint = entry.parameter, entry.label, _hint(entry)
    value = parameter.value
    if parameter.key in row_parameters():
        return _RowsControl(parameter, gui.add_text(label, "", hint=hint), send)
    if parameter.kind == "choice":
        # A law that is not loaded cannot be chosen, but it is the law of the run.
        choices = dict.fromkeys((*parameter.choices, str(value)))
        choice = gui.add_dropdown(label, tuple(choices), initial_value=str(value), hint=hint)
        return _PlainControl(parameter, choice, send)
    if parameter.kind == "boolean":
        return _PlainControl(parameter, gui.add_checkbox(label, bool(value), hint=hint), send)
    if _is_text(entry):
        return _TextControl(parameter, gui.add_text(label, as_text(value), hint=hint), send)
    if parameter.kind == "integer":
        assert isinstance(value, int)
        return _PlainControl(parameter, gui.add_number(label, value, step=1, hint=hint), send)
    if parameter.changeable:
        return _add_slider(gui, entry, definitions, send)
    assert isinstance(value, float)
    number = gui.add_number(label, value, step=round_step(abs(value) * 10.0 or 1.0), hint=hint)
    number.precision = max(_DECIMALS, number.precision)
    return _PlainControl(parameter, number, send)


def _unbroken(label: str) -> str:
    """A label whose unit is on one line."""
    name, bracket, unit = label.partition("[")
    return name + bracket + unit.replace(" ", "\N{NO-BREAK SPACE}")


def _is_text(entry: Entry) -> bool:
    parameter = entry.parameter
    if entry.as_text or parameter.kind == "text" or parameter.optional:
        return True
    return parameter.kind == "number-or-list" and not parameter.changeable


def _add_slider(
    gui: viser.GuiApi, entry: Entry, definitions: Mapping[str, Parameter], send: Send
) -> Control:
    value = entry.parameter.value
    first = value[0] if isinstance(value, tuple) else value
    assert isinstance(first, float)
    low, high, step = slider_range(entry.parameter, definitions, first)
    is_single = not isinstance(value, tuple)
    slider = gui.add_slider(
        entry.label, low, high, step, first, hint=f"{_hint(entry)}{_BEYOND}", visible=is_single
    )
    return _SliderControl(entry.parameter, definitions, slider, send)


def _hint(entry: Entry) -> str:
    """Tooltip of a control: description, key, limits, and when it acts."""
    parameter = entry.parameter
    means = " One number, or several separated by commas." if entry.as_text else ""
    if parameter.key in row_parameters():
        means = " Commas separate numbers, semicolons separate rows; empty for none."
    optional = " Empty for none." if parameter.optional else ""
    acts_anyhow = parameter.changeable or is_of_disturbance(parameter.key)
    reach = "" if acts_anyhow else " It cannot change during a run, and acts on the whole run."
    return f"{parameter.text}{means}{optional} {parameter.key}, {parameter.limit}.{reach}"


def as_text(value: object) -> str:
    """An exact value as the text of a field; lists are separated by commas."""
    if isinstance(value, (tuple, list)):
        return ", ".join(map(as_text, value))
    if value is None:
        return ""
    return repr(value).removesuffix(".0") if isinstance(value, float) else str(value)


def parse_text(text: str) -> Value:
    """The numbers of a text field, None if it is empty; otherwise the text itself."""
    if not text.strip():
        return None
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        return text
    return numbers if len(numbers) > 1 else numbers[0]
