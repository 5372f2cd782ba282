"""The hands that hold the random objects: two, three, four and six fingers."""

from __future__ import annotations

from dataclasses import replace

from benchmarks.hands import holding_hand
from benchmarks.robustness_worlds import SETTINGS, two_fingers
from slipgrasp.core.scenario import Estimate, Scenario
from slipgrasp.core.scenario.loading import load_scenario, with_values

# Errors of the model load weak contacts by more than their normal forces allow.
MORE_SETTINGS = {"controller.grip_safety": 1.2, "controller.minimum_normal_force": 10.0}


def hand_of(n: int) -> Scenario:
    """Two and three fingers as in their presets; more fingers on the two faces of case II."""
    settings = {**SETTINGS, **MORE_SETTINGS}
    if n == 2:
        return two_fingers()
    if n == 3:
        return with_values(load_scenario("three-fingers"), settings)
    base = load_scenario("composite-case-2")
    unknowns = tuple(
        Estimate(parameter=f"fingers.{i}.friction", initial=1.2, minimum=0.05, maximum=2.0)
        for i in range(n)
    )
    hand = replace(
        base, fingers=holding_hand(n).fingers, estimates=(*unknowns, *base.estimates[2:])
    )
    return with_values(hand, settings)
