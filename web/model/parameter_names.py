"""Names of the parameters on the page, alone and in sentences."""

from __future__ import annotations

import re
from collections import Counter
from functools import lru_cache

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import parameter_definitions
from slipgrasp.core.scenario.parameters import Parameter
from slipgrasp.core.words.parameter_words import estimate_words, key_words, unit_words

_QUIET_HEADS = ("controller.", "sensing.", "actuation.", "simulation.", "trajectory.")
_PARTS = "object|fingers|trajectory|controller|estimates|sensing|actuation|simulation"
_KEYS = re.compile(rf"\b(?:{_PARTS})(?:\.(?:\w+|\*))+")


class ParameterNames:
    """Names of the parameters of a scenario.

    Args:
        scenario: The scenario.

    Attributes:
        definitions: Its parameters by dotted key.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self.definitions = parameter_definitions(scenario)
        self._tails = Counter(key.removeprefix(_quiet_head(key)) for key in self.definitions)

    def words(self, key: str) -> str:
        """The name of a parameter, such as ``friction of all fingers``.

        Args:
            key: Its dotted key, or that of a list, possibly with a ``*``; an unknown one is
                returned.
        """
        names = self._scenario.finger_names
        if key.startswith("fingers.*."):
            return f"{key_words(key.removeprefix('fingers.*.'), names)} of all fingers"
        if (target := self._estimated(key)) is not None:
            return estimate_words(key.rpartition(".")[2], key_words(target.key, names))
        if key not in self.definitions and f"{key}.0" not in self.definitions:
            return key
        head = _quiet_head(key)
        if self._tails[key.removeprefix(head)] > 1:
            head = ""  # such as the noise of the sensors and the noise that the law assumes
        words = key_words(key, names, self._scenario.space)
        return words.removeprefix(head.replace(".", " "))

    def unit(self, key: str) -> str:
        """The unit of a parameter, ``1`` for pure numbers."""
        parameter = self._estimated(key) or self.definitions.get(key.replace(".*.", ".0."))
        return "" if parameter is None else parameter.unit

    def label(self, key: str) -> str:
        """The name of a parameter, with unit."""
        return f"{self.words(key)}{unit_words(self.unit(key))}"

    def _estimated(self, key: str) -> Parameter | None:
        """The estimated parameter; None if the key does not belong to an estimate."""
        head, _, rest = key.partition(".")
        place, estimates = rest.partition(".")[0], self._scenario.estimates
        if head != "estimates" or not place.isdigit() or int(place) >= len(estimates):
            return None
        return self.definitions.get(estimates[int(place)].parameter)


def _quiet_head(key: str) -> str:
    """The redundant part of a dotted key, which may be empty."""
    return next((head for head in _QUIET_HEADS if key.startswith(head)), "")


@lru_cache(maxsize=8)
def names_of(scenario: Scenario) -> ParameterNames:
    """The names of a scenario, cached because they take milliseconds."""
    return ParameterNames(scenario)


def in_page_words(text: str, scenario: Scenario) -> str:
    """Replaces the dotted keys of a scenario in a sentence by names.

    Args:
        text: The sentence.
        scenario: The scenario of the keys.
    """
    return _KEYS.sub(lambda found: names_of(scenario).words(found[0]), text)
