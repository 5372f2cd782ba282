"""The sliders of a page: which parameters they set, between which values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from slipgrasp.core.exceptions import ScenarioError, SlipgraspError
from slipgrasp.core.scenario import PlanarScenario
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.scenario.table import place_of
from slipgrasp.core.scenario.table import places as table_places
from slipgrasp.web.model.parameter_names import ParameterNames, names_of
from slipgrasp.web.model.slider_range import slider_range
from slipgrasp.web.scene.scene import shape_of

DEFAULT = ("object.mass", "fingers.*.friction", "controller.position_gain")
_ALL = "fingers.*."


class ControlError(SlipgraspError):
    """A parameter that cannot have a slider."""


class Control(NamedTuple):
    """One slider.

    Attributes:
        key: Dotted key of its parameter, maybe with ``*`` for all fingers.
        label: Name and unit.
        text: What the parameter is, in a sentence.
        low: Smallest value.
        high: Largest value.
        step: Step from value to value.
        value: The value of the scenario.
        places: Where the value stands in the table of the scenario.
    """

    key: str
    label: str
    text: str
    low: float
    high: float
    step: float
    value: float
    places: tuple[int, ...]


def controls_of(scenario: PlanarScenario, keys: Sequence[str]) -> tuple[Control, ...]:
    """Sliders for some parameters of a scenario.

    Args:
        scenario: The scenario.
        keys: Dotted keys, with ``fingers.*.`` for all fingers at once.

    Raises:
        ControlError: If a parameter does not exist, is not one number, or changes the shape of
            what is drawn.
    """
    names = names_of(scenario)
    return tuple(_control(scenario, key, names) for key in dict.fromkeys(keys))


def _control(scenario: PlanarScenario, key: str, names: ParameterNames) -> Control:
    parameter = names.definitions.get(key.replace(".*.", ".0."))
    if parameter is None or not isinstance(parameter.value, float):
        raise ControlError(f"'{key}' is no parameter with one number; see slipgrasp scenarios")
    value, places = parameter.value, tuple(_places(scenario, key))
    low, high, step = slider_range(parameter, names.definitions, value)
    for end in (low, high):
        _check_end(scenario, key, end)
    return Control(key, names.label(key), parameter.text, low, high, step, value, places)


def _check_end(scenario: PlanarScenario, key: str, end: float) -> None:
    """Tries the end of a slider.

    Raises:
        ControlError: If the scenario does not allow it, or it changes the shape of what is drawn.
    """
    try:
        other = with_values(scenario, {each: end for each in _keys(scenario, key)})
    except ScenarioError as error:
        raise ControlError(f"'{key}' cannot be a slider here: {error}") from error
    if shape_of(other) != shape_of(scenario):
        raise ControlError(f"'{key}' changes the shape of what is drawn: no slider for it")


def _keys(scenario: PlanarScenario, key: str) -> list[str]:
    """The keys of single parameters."""
    if not key.startswith(_ALL):
        return [key]
    return [key.replace("*", str(i), 1) for i in range(len(scenario.fingers))]


def _places(scenario: PlanarScenario, key: str) -> Iterator[int]:
    for each in _keys(scenario, key):
        place = place_of(each)
        if place is not None:
            yield place
        else:
            # A number that may be a list stands in every place of the list.
            first, shape, strides = table_places()[f"{each}.*"]
            yield from (first + k * strides[0] for k in range(shape[0]))
