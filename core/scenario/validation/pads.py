"""Checks for features that soft fingertips do not support yet."""

from __future__ import annotations

from collections.abc import Iterator

from slipgrasp.core.exceptions import FieldError
from slipgrasp.core.scenario.chosen_laws import kinds_in
from slipgrasp.core.scenario.custom_laws import LAW, law_of
from slipgrasp.core.scenario.spatial import SpatialScenario


def check_pads(scenario: SpatialScenario) -> Iterator[FieldError]:
    """Checks that soft fingertips use the cone, known phases and a law that allows for moments."""
    if not scenario.has_soft_fingers:
        return
    controller = scenario.controller
    laws = [law_of(kind) for kind in kinds_in(scenario)]
    if scenario.simulation.friction == "pyramid":
        yield _refused("simulation.friction", "'pyramid'", "set it to 'cone'")
    if not scenario.sensing.true_phases:
        yield _refused("sensing.true_phases", "false", "set it to true")
    if controller.prediction:
        yield _refused("controller.prediction", "true", "set it to false")
    if controller.distribution != "hold" and any(law.uses_friction for law in laws):
        yield _refused(
            "controller.distribution", f"'{controller.distribution}'", "set it to 'hold'"
        )
    for law in laws:
        if law.learns and not law.has_memory:
            way_out = "choose composite, or a law without adaptation"
            yield _refused(LAW, f"'{law.kind}'", way_out)


def _refused(field: str, shown: str, way_out: str) -> FieldError:
    words = (
        f"is {shown}, which is not computed for soft fingertips yet; {way_out}, or every "
        "fingers.*.pad_radius to 0"
    )
    return FieldError.at(field, shown, way_out, words)
