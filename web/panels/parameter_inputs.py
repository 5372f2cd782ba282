"""From the definition of a parameter to a knob: the one way any input of a scenario is made."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import viser

from core.parameters import Parameter
from web.intents.intent import Send
from web.intents.scenario import SetParameter

__all__ = [
    "Knob",
    "SliderRange",
    "add_knob",
    "as_text",
    "is_offered",
    "parse_numbers",
    "slider_range",
]

Knob = (
    viser.GuiSliderHandle[float]
    | viser.GuiNumberHandle[int]
    | viser.GuiDropdownHandle[str]
    | viser.GuiTextHandle
)

_STEPS_PER_SLIDER = 200


class SliderRange(NamedTuple):
    """Where a slider moves, in the unit of its parameter."""

    low: float
    high: float
    step: float


def is_offered(parameter: Parameter) -> bool:
    """Whether the dashboard has a knob for it: all that may change while a hand is at work."""
    return parameter.changeable and parameter.value is not None


def slider_range(parameter: Parameter, definitions: Mapping[str, Parameter]) -> SliderRange:
    """Where the slider of a number moves: its typical range, widened to hold its value.

    Args:
        parameter: A number. One that estimates another has the typical range of that one.
        definitions: Every parameter of the scenario by key.
    """
    value = float(parameter.value)  # type: ignore[arg-type]
    typical = parameter.typical or _estimated(parameter, definitions)
    low, high = typical or (min(0.5 * value, 2.0 * value), max(0.5 * value, 2.0 * value))
    low, high = min(low, value), max(high, value)
    if high <= low:
        high = low + 1.0
    step = _round_step((high - low) / _STEPS_PER_SLIDER)
    return SliderRange(low, high, step)


def _estimated(
    parameter: Parameter, definitions: Mapping[str, Parameter]
) -> tuple[float, float] | None:
    """The typical range of the parameter that this one is an estimate of."""
    sibling = definitions.get(f"{parameter.key.rpartition('.')[0]}.parameter")
    target = definitions.get(str(sibling.value)) if sibling else None
    return target.typical if target else None


def _round_step(step: float) -> float:
    power = 10.0 ** math.floor(math.log10(step))
    return max(power * factor for factor in (1.0, 2.0, 5.0) if power * factor <= step * (1 + 1e-9))


def add_knob(
    gui: viser.GuiApi,
    label: str,
    parameter: Parameter,
    definitions: Mapping[str, Parameter],
    send: Send,
) -> Knob:
    """Adds the input of one parameter; moving it sends an intent.

    Args:
        gui: Where it goes.
        label: What it is called, with its unit.
        parameter: Its definition, with the value it starts at.
        definitions: Every parameter of the scenario by key.
        send: Takes the intent.
    """
    knob = _add_input(gui, label, parameter, definitions)

    def changed(event: viser.GuiEvent[Any]) -> None:
        # Values that the program sets come without a client; they must not come back.
        if event.client_id is not None:
            value = event.target.value
            is_list = isinstance(event.target, viser.GuiTextHandle)
            send(SetParameter(parameter.key, parse_numbers(str(value)) if is_list else value))

    knob.on_update(changed)
    return knob


def _add_input(
    gui: viser.GuiApi, label: str, parameter: Parameter, definitions: Mapping[str, Parameter]
) -> Knob:
    hint = f"{parameter.text} {parameter.key}, {parameter.limit}."
    value = parameter.value
    if parameter.kind == "choice":
        return gui.add_dropdown(label, parameter.choices, initial_value=str(value), hint=hint)
    if parameter.kind == "integer" and isinstance(value, int):
        return gui.add_number(label, value, hint=hint)
    if isinstance(value, float):
        low, high, step = slider_range(parameter, definitions)
        return gui.add_slider(label, low, high, step, value, hint=hint)
    return gui.add_text(label, as_text(value), hint=hint)


def as_text(value: object) -> str:
    """A value as the text of a field; a list of numbers with commas."""
    return ", ".join(f"{v:g}" for v in value) if isinstance(value, tuple) else str(value)


def parse_numbers(text: str) -> list[float] | str:
    """The numbers of a text field, or the text itself where it is not a list of numbers."""
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        return text
