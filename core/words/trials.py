"""What a hint asks for as values to set, so that following it is one step.

A hint says in which direction a parameter should go; a trial goes there by a factor of two, or as
far as the parameter may. An option that leaves open what to set, such as a longer face, is none.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.law_choice import LAW
from slipgrasp.core.scenario.loading import parameter_definitions

_KEY = r"[a-z_]+(?:\.\w+)+"
_NUMBER = r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"
_UNITS = r"N m s|N m/s|N m|N/s|N|kg m²|kg|m/s²|m/s|m|rad/s²|rad|1/s²|1/s|Hz|s"
_UNIT = rf"(?: (?:{_UNITS})(?![/²\w]))?"
_INITIAL = r"estimates\.\d+\.initial"
_LINK = r"(?:, | and )?"
_FACTOR = 2.0
_LESS = 0.8
"""Part of the true friction to believe in, where believing in more was the mistake."""
_DIGITS = 6
_OPTIONS = re.compile(
    rf"(?P<way>raise|lower) (?P<key>{_KEY}) (?:above|below) (?P<value>{_NUMBER}){_UNIT}"
    r"|(?P<all>lower fingers\.\*\.friction)"
    rf"|set (?P<truths>(?:{_LINK}{_INITIAL} nearer to {_NUMBER}{_UNIT})+) \(the truth\)"
    rf"|set (?P<beliefs>(?:{_LINK}{_INITIAL} below {_NUMBER})+)"
    r"|(?P<force>set controller\.grasp_force to minimum)"
    r"|set (?P<period>controller\.control_period) to (?P<seconds>0\.001) s"
    r"|use the (?P<law>composite) law",
    re.IGNORECASE,
)
_BELIEF = re.compile(rf"(estimates\.(\d+)\.initial) (?:nearer to|below) ({_NUMBER})")


@dataclass(frozen=True, slots=True)
class Trial:
    """One option of a hint that can be tried as it stands.

    Attributes:
        words: What it sets, with parameters by their dotted keys.
        values: The values, by dotted key; a law brings the settings it is meant for.
    """

    words: str
    values: Mapping[str, float | str]


def trials_in(hint: str, scenario: Scenario) -> tuple[Trial, ...]:
    """The options of a hint that can be tried, in its order.

    Args:
        hint: As `slipgrasp.core.words.hints` words it.
        scenario: Of the run that it is about.
    """
    found = (_trial(option, scenario) for option in _OPTIONS.finditer(hint))
    return tuple(trial for trial in found if trial is not None)


def purpose_of(hint: str) -> str | None:
    """What a hint is for, such as ``for less slip``; None if it has options that are no trials.

    Args:
        hint: As `slipgrasp.core.words.hints` words it.
    """
    rest = re.sub(r"\bor\b|[,.]", " ", _OPTIONS.sub(" ", hint))
    purpose = " ".join(rest.split())
    return purpose if re.fullmatch(r"((to|for|until) [^;()]*)?", purpose) else None


def _trial(option: re.Match[str], scenario: Scenario) -> Trial | None:
    groups = {name: text for name, text in option.groupdict().items() if text is not None}
    match groups:
        case {"way": way, "key": key, "value": value}:
            return _towards(way.lower(), key, float(value), scenario)
        case {"all": _}:
            return _less_friction(scenario)
        case {"truths": beliefs}:
            return Trial(*_beliefs(beliefs, scenario, 1.0))
        case {"beliefs": beliefs}:
            return Trial(*_beliefs(beliefs, scenario, _LESS))
        case {"force": _}:
            return Trial("controller.grasp_force: minimum", {"controller.grasp_force": "minimum"})
        case {"period": key, "seconds": seconds}:
            return Trial(f"{key}: {seconds} s", {key: float(seconds)})
        case {"law": law}:
            return Trial(f"{law} law", {LAW: law})
        case _:
            return None


def _towards(way: str, key: str, value: float, scenario: Scenario) -> Trial | None:
    """A parameter twice as large or half as large, as far as its bounds allow."""
    parameter = parameter_definitions(scenario).get(key)
    if parameter is None:
        return None
    if way == "raise":
        usual = parameter.typical[1] if parameter.typical else 1.0
        wanted = _FACTOR * value if value > 0.0 else usual
        wanted = wanted if parameter.maximum is None else min(wanted, parameter.maximum)
    else:
        wanted = value / _FACTOR
        wanted = wanted if parameter.minimum is None else max(wanted, parameter.minimum)
    unit = "" if parameter.unit in ("", "1") else f" {parameter.unit}"
    wanted = int(wanted) if parameter.kind == "integer" else _rounded(wanted)
    return Trial(f"{key}: {value:g} → {wanted:g}{unit}", {key: wanted})


def _less_friction(scenario: Scenario) -> Trial:
    values = {
        f"fingers.{i}.friction": _rounded(finger.friction / _FACTOR)
        for i, finger in enumerate(scenario.fingers)
    }
    told = " and ".join(f"{value:g}" for value in dict.fromkeys(values.values()))
    return Trial(f"fingers.*.friction: {told}", values)


def _beliefs(
    option: str, scenario: Scenario, share: float
) -> tuple[str, Mapping[str, float | str]]:
    values: dict[str, float | str] = {}
    told: list[str] = []
    for key, place, true in _BELIEF.findall(option):
        least = scenario.estimates[int(place)].minimum
        value = _rounded(max(share * float(true), -float("inf") if least is None else least))
        values[key] = value
        told.append(f"{key}: {value:g}")
    truth = " (the truth)" if share == 1.0 else ""
    return f"{', '.join(told)}{truth}", values


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")
