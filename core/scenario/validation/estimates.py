"""Whether the unknowns can be estimated together."""

from __future__ import annotations

import math
from collections.abc import Iterator

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.unknowns import parse_unknown


def check_estimates(scenario: Scenario) -> Iterator[FieldError]:
    """Unknowns exist, each once, within their bounds, and can be told apart."""
    seen: set[str] = set()
    kinds: set[str] = set()
    for i, estimate in enumerate(scenario.estimates):
        key = f"estimates.{i}"
        unknown = parse_unknown(scenario, estimate.parameter)
        if unknown is None:
            yield FieldError(
                field=f"{key}.parameter",
                value=estimate.parameter[:80],
                limit="object.mass, object.inertia, fingers.N.friction, fingers.N.link_masses.K",
                message=(
                    f"{key}.parameter '{estimate.parameter[:80]}' cannot be estimated; "
                    "object.mass, object.inertia, fingers.N.friction and fingers.N.link_masses.K "
                    "can"
                ),
            )
            continue
        if estimate.parameter in seen:
            yield FieldError(
                field=f"{key}.parameter",
                value=estimate.parameter,
                limit="each parameter once",
                message=f"{key}.parameter '{estimate.parameter}' is estimated twice",
            )
        seen.add(estimate.parameter)
        kinds.add(unknown.kind)
        low = -math.inf if estimate.minimum is None else estimate.minimum
        high = math.inf if estimate.maximum is None else estimate.maximum
        if not low <= estimate.initial <= high or low >= high:
            yield FieldError(
                field=f"{key}.initial",
                value=estimate.initial,
                limit=f"{low:g} … {high:g}",
                message=(
                    f"{key}.initial is {estimate.initial:g}, outside its own bounds {low:g} … "
                    f"{high:g}"
                ),
            )
    if {"link_mass", "friction"} <= kinds:
        yield FieldError(
            field="estimates",
            value=None,
            limit="link masses or friction, not both",
            message=(
                "estimates: link masses and friction cannot be unknown at once, their product "
                "makes the regression bilinear; estimate one kind and give the other"
            ),
        )
