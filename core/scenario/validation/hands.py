"""Checks that the kernel of a kind of hand supports a scenario.

The supported parameters and facts of control laws are declared with them (`Quantity.hands`); a test
checks all declarations.
"""

from __future__ import annotations

from collections.abc import Iterator

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.custom_laws import LAW, law_names, law_of
from slipgrasp.core.scenario.field_errors import echo
from slipgrasp.core.scenario.laws import is_computed_for
from slipgrasp.core.scenario.parameters import values_not_for


def check_computed(scenario: Scenario) -> Iterator[FieldError]:
    """Checks that the law and all non-default parameters are supported for this kind of hand."""
    hand, kind = scenario.space, scenario.controller.kind
    if not is_computed_for(law_of(kind), hand):
        laws = [name for name in law_names() if is_computed_for(law_of(name), hand)]
        yield not_computed(scenario, LAW, f"'{kind}'", f"choose one of {', '.join(laws)}")
    for key, value, usual in values_not_for(scenario, hand):
        yield not_computed(scenario, key, _words_of(value), f"set it to {_words_of(usual)}")


def not_computed(scenario: Scenario, key: str, shown: str, way_out: str) -> FieldError:
    """Returns the error for a value that the kernel of this kind of hand does not support.

    Args:
        scenario: A scenario of this kind of hand.
        key: Dotted key.
        shown: Its value.
        way_out: Remedy.
    """
    hands = f"{scenario.space.name} hands"
    words = f"is {shown}, which is not computed for {hands} yet; {way_out}"
    return FieldError.at(key, shown, way_out, words)


def _words_of(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f"'{value}'"
    return f"{value:g}" if isinstance(value, float | int) else str(echo(value) or value)
