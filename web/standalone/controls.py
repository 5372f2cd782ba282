"""Sliders of a page: their parameters and ranges."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from slipgrasp.core.exceptions import ScenarioError, SlipgraspError
from slipgrasp.core.run.engine import make_engine
from slipgrasp.core.scenario import PlanarScenario, Scenario
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.scenario.table import place_of
from slipgrasp.core.scenario.table import places as table_places
from slipgrasp.web.model.parameter_names import ParameterNames, names_of
from slipgrasp.web.model.slider_range import SliderRange, round_step, slider_range
from slipgrasp.web.scene.node_shape import shape_of
from slipgrasp.web.standalone.kernel_data import bytes_of

_USUAL = ("object.mass", "fingers.*.friction")
_ALL = "fingers.*."
_NUMBER = r"[-+]?[\d.]+(?:e[-+]?\d+)?"


class ControlError(SlipgraspError):
    """A parameter that cannot have a slider."""


def usual_controls(scenario: Scenario) -> tuple[str, ...]:
    """Default parameters of the sliders: those of a short list that the scenario supports."""
    planar = isinstance(scenario, PlanarScenario)
    keys = (*_USUAL, "controller.position_gain") if planar else _USUAL
    return tuple(key for key in keys if _is_possible(scenario, key))


class Control(NamedTuple):
    """A slider.

    Attributes:
        key: Dotted key of its parameter, possibly with ``*`` for all fingers.
        label: Name and unit.
        text: Description of the parameter, a sentence.
        low: Smallest value.
        high: Largest value.
        step: Step.
        value: Value of the scenario.
        places: Indices of the value in the table of the scenario; for spatial hands, in the numbers
            of the model followed by those of the run at its start.
    """

    key: str
    label: str
    text: str
    low: float
    high: float
    step: float
    value: float
    places: tuple[int, ...]


def controls_of(scenario: Scenario, keys: Sequence[str]) -> tuple[Control, ...]:
    """Creates sliders for parameters of a scenario.

    Args:
        scenario: The scenario.
        keys: Dotted keys, with ``fingers.*.`` for all fingers, and optionally the range of the
            slider: ``KEY=LOW:HIGH``.

    Raises:
        ControlError: If a parameter does not exist, is not one number, or changes the shape of the
            scene.
    """
    names = names_of(scenario)
    return tuple(_control(scenario, key, names) for key in dict.fromkeys(keys))


def _is_possible(scenario: Scenario, key: str) -> bool:
    with suppress(ControlError):
        return bool(controls_of(scenario, (key,)))
    return False


def _control(scenario: Scenario, chosen: str, names: ParameterNames) -> Control:
    key, _, ends = chosen.partition("=")
    parameter = names.definitions.get(key.replace(".*.", ".0."))
    if parameter is None or not isinstance(parameter.value, float):
        raise ControlError(
            f"'{key}' is not a parameter with one number; "
            "'slipgrasp scenarios parameters' lists them"
        )
    value = parameter.value
    low, high, step = (
        _chosen_range(chosen, ends, value)
        if ends
        else slider_range(parameter, names.definitions, value)
    )
    for end in (low, high):
        _check_end(scenario, key, end)
    found = (
        _places(scenario, key)
        if isinstance(scenario, PlanarScenario)
        else _in_model(scenario, key, (low, high))
    )
    places = tuple(found)
    return Control(key, names.label(key), parameter.text, low, high, step, value, places)


def _chosen_range(chosen: str, ends: str, value: float) -> SliderRange:
    """Parses the range of a slider, extended to include its value.

    Raises:
        ControlError: If it is not two numbers in ascending order.
    """
    found = re.fullmatch(rf"({_NUMBER}):({_NUMBER})", ends)
    low, high = map(float, found.groups()) if found else (0.0, 0.0)
    if not low < high:
        raise ControlError(f"'{chosen}': give the ends of the slider as KEY=LOW:HIGH")
    return SliderRange(min(low, value), max(high, value), round_step(high - low))


def _check_end(scenario: Scenario, key: str, end: float) -> None:
    """Validates a slider at one end of its range.

    Raises:
        ControlError: If the scenario does not allow the value, or it changes the shape of the
            scene.
    """
    try:
        other = with_values(scenario, {each: end for each in _keys(scenario, key)})
    except ScenarioError as error:
        raise ControlError(f"'{key}' cannot have a slider: {error}") from error
    if shape_of(other) != shape_of(scenario):
        raise ControlError(
            f"'{key}' cannot have a slider, because it changes the shape of the scene"
        )


def _in_model(scenario: Scenario, key: str, values: Sequence[float]) -> Iterator[int]:
    """Indices in the packed model and run that contain the value itself.

    Raises:
        ControlError: If the kernel of spatial hands uses values derived from it.
    """
    models = []
    for value in values:
        other = with_values(scenario, {each: value for each in _keys(scenario, key)})
        engine = make_engine(other, keeps_rows=True)
        packed = bytes_of(engine.pack()), bytes_of(engine.run)
        models.append(np.concatenate(packed).view("<f8"))
    low, high = models
    # Compared by bits, because integers among them may look like NaN.
    places = np.flatnonzero(low.view(np.int64) != high.view(np.int64))
    if any((low[k], high[k]) != tuple(values) for k in places):
        raise ControlError(f"'{key}' cannot be a slider of a spatial hand")
    yield from map(int, places)


def _keys(scenario: Scenario, key: str) -> list[str]:
    """The keys of single parameters."""
    if not key.startswith(_ALL):
        return [key]
    return [key.replace("*", str(i), 1) for i in range(len(scenario.fingers))]


def _places(scenario: Scenario, key: str) -> Iterator[int]:
    for each in _keys(scenario, key):
        place = place_of(each)
        if place is not None:
            yield place
        else:
            # A number that may be a list occupies every index of the list.
            first, shape, strides = table_places()[f"{each}.*"]
            yield from (first + k * strides[0] for k in range(shape[0]))
