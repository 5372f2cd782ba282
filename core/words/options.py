"""Suggested changes, as text and, if one step suffices, as values.

Values change by a factor of two, or up to their bound. An option without a specific value, such as
a longer face, has no values.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.law_choice import LAW
from slipgrasp.core.scenario.parameters import Parameter, find_parameter
from slipgrasp.core.scenario.unknowns import unit_of_unknown
from slipgrasp.core.words.parameter_words import value_words
from slipgrasp.core.words.phrases import joined

_FACTOR = 2.0
_LESS = 0.8
"""Fraction of the true friction that is suggested after an estimate that was too large."""
_DIGITS = 6
_BELIEF_DIGITS = 3
_SAMPLED = 0.001


@dataclass(frozen=True, slots=True)
class Option:
    """A suggested change.

    Attributes:
        words: Clause with parameters by their dotted keys.
        values: Suggested values by dotted key; a law includes its recommended settings. Empty if
            nothing specific is suggested.
        label: The values in a few words; empty if there are none.
    """

    words: str
    values: Mapping[str, float | str | bool] = field(default_factory=dict)
    label: str = ""

    def with_(self, *others: Option) -> Option:
        """This option combined with others."""
        options = (self, *others)
        values = {key: value for option in options for key, value in option.values.items()}
        words = joined([option.words for option in options])
        return Option(words, values, ", ".join(option.label for option in options))


def raise_(scenario: Scenario, key: str, factor: float = _FACTOR) -> Iterator[Option]:
    """Raises a parameter above its value, unless it is at its bound."""
    parameter = find_parameter(scenario, key)
    if parameter is None or not isinstance(parameter.value, (int, float)):
        yield Option(f"raise {key}")
    elif parameter.maximum is None or parameter.value < parameter.maximum:
        usual = parameter.typical[1] if parameter.typical else 1.0
        wanted = factor * parameter.value if parameter.value > 0.0 else usual
        yield _move("raise", "above", parameter, wanted)


def lower(scenario: Scenario, key: str) -> Iterator[Option]:
    """Lowers a parameter below its value, unless it is at its bound."""
    parameter = find_parameter(scenario, key)
    if parameter is None or not isinstance(parameter.value, (int, float)):
        yield Option(f"lower {key}")
    elif parameter.minimum is None or parameter.value > parameter.minimum:
        yield _move("lower", "below", parameter, parameter.value / _FACTOR)


def set_to(key: str, value: float | str | bool, unit: str = "") -> Option:
    """Sets a parameter to a value."""
    told = value_words(value, unit)
    return Option(f"set {key} to {told}", {key: value}, f"{key}: {told}")


def sample_at_1_khz() -> Option:
    """Uses sampled control with a period of 1 ms."""
    return set_to("controller.control_period", _SAMPLED, "s")


def use_law(name: str) -> Option:
    """Uses another law."""
    return Option(f"use the {name} law", {LAW: name}, f"{name} law")


def believe_the_truth(scenario: Scenario, truths: Mapping[int, float]) -> Iterator[Option]:
    """Starts with the true values of some unknowns, or the nearest values within their bounds.

    Args:
        scenario: The initial scenario.
        truths: True values by index of the estimate, SI.
    """
    wanted = {k: _rounded(true, _BELIEF_DIGITS) for k, true in truths.items()}
    values = _beliefs(scenario, wanted)
    open_ = [k for k in wanted if values[_initial(k)] != scenario.estimates[k].initial]
    units = {k: unit_of_unknown(scenario, scenario.estimates[k].parameter) for k in open_}
    if open_:
        nearer = [f"{_initial(k)} nearer to {wanted[k]:g}{units[k]}" for k in open_]
        are_true = all(values[_initial(k)] == wanted[k] for k in open_)
        label = f"{_told(values)}{' (the truth)' * are_true}"
        yield Option(f"set {joined(nearer)} (the truth)", values, label)


def believe_in_less(scenario: Scenario, truths: Mapping[int, float]) -> Iterator[Option]:
    """Starts with less than the true values of some unknowns.

    Args:
        scenario: The initial scenario.
        truths: True values by index of the estimate, SI.
    """
    if truths:
        below = [f"{_initial(k)} below {true:.3g}" for k, true in truths.items()]
        wanted = {k: _LESS * _rounded(true, _BELIEF_DIGITS) for k, true in truths.items()}
        values = _beliefs(scenario, wanted)
        yield Option(f"set {joined(below)}", values, _told(values))


def lower_all_friction(scenario: Scenario) -> Iterator[Option]:
    """Lowers the friction of all faces, unless none has friction."""
    if any(finger.friction > 0.0 for finger in scenario.fingers):
        key = "fingers.*.friction"
        values = {
            f"fingers.{i}.friction": _rounded(finger.friction / _FACTOR)
            for i, finger in enumerate(scenario.fingers)
        }
        told = joined([f"{value:g}" for value in dict.fromkeys(values.values())])
        yield Option(f"lower {key}", values, f"{key}: {told}")


def only_words(*words: str) -> Iterable[Option]:
    """Options without specific values."""
    return map(Option, words)


def _move(verb: str, side: str, parameter: Parameter, wanted: float) -> Option:
    key, value = parameter.key, parameter.value
    wanted = _within(_rounded(wanted), parameter.minimum, parameter.maximum)
    wanted = int(wanted) if parameter.kind == "integer" else wanted
    label = f"{key}: {value:g} → {value_words(wanted, parameter.unit)}"
    return Option(f"{verb} {key} {side} {value_words(value, parameter.unit)}", {key: wanted}, label)


def _initial(index: int) -> str:
    return f"estimates.{index}.initial"


def _beliefs(scenario: Scenario, wanted: Mapping[int, float]) -> dict[str, float]:
    """Initial estimates as close to the desired ones as their bounds allow, by dotted key.

    The bounds are applied last, because rounding after them could exceed them.
    """
    return {
        _initial(k): _within(
            _rounded(value), scenario.estimates[k].minimum, scenario.estimates[k].maximum
        )
        for k, value in wanted.items()
    }


def _within(value: float, minimum: float | None, maximum: float | None) -> float:
    value = value if minimum is None else max(value, minimum)
    return value if maximum is None else min(value, maximum)


def _told(values: Mapping[str, float]) -> str:
    return ", ".join(f"{key}: {value:g}" for key, value in values.items())


def _rounded(value: float, digits: int = _DIGITS) -> float:
    return float(f"{value:.{digits}g}")
