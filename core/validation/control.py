"""Whether the gains fit the hand, and the control period the law."""

from __future__ import annotations

from collections.abc import Iterator

from core.exceptions import FieldError
from core.scenario import Scenario

__all__ = ["check_control", "check_gains", "check_least_gain"]

MIN_CONTROL_PERIOD = 1e-4
MIN_POSITION_GAIN = 1e-3


def check_gains(scenario: Scenario) -> Iterator[FieldError]:
    """A list of gains has one number per coordinate, or per unknown."""
    num_coordinates = 3 + len(scenario.fingers)
    sizes = {
        "velocity_gain": num_coordinates,
        "lyapunov_weight": num_coordinates,
        "adaptation_gain": len(scenario.estimates),
    }
    for name, size in sizes.items():
        value = getattr(scenario.controller, name)
        if isinstance(value, tuple) and len(value) != size:
            yield FieldError(
                field=f"controller.{name}",
                value=len(value),
                limit=f"{size} numbers",
                message=f"controller.{name} has {len(value)} numbers; give one number, or {size}",
            )


def check_least_gain(scenario: Scenario) -> Iterator[FieldError]:
    """A tiny K_p makes P12 = Q / (2 K_p) of Eq. 25 huge, and the adaptation with it."""
    gain = scenario.controller.position_gain
    for value in gain if isinstance(gain, tuple) else (gain,):
        if 0.0 < value < MIN_POSITION_GAIN:
            yield FieldError(
                field="controller.position_gain",
                value=value,
                limit=f"0 or at least {MIN_POSITION_GAIN:g} 1/s^2",
                message=(
                    f"controller.position_gain is {value:g} 1/s^2; 0 means no position feedback, "
                    f"otherwise at least {MIN_POSITION_GAIN:g} 1/s^2"
                ),
            )


def check_control(scenario: Scenario) -> Iterator[FieldError]:
    """The control period is 0 or long enough, and the grasp force can be chosen."""
    period = scenario.controller.control_period
    if 0.0 < period < MIN_CONTROL_PERIOD:
        yield FieldError(
            field="controller.control_period",
            value=period,
            limit=f"0 or at least {MIN_CONTROL_PERIOD:g} s",
            message=(
                f"controller.control_period is {period:g} s; 0 means continuous control, otherwise"
                f" at least {MIN_CONTROL_PERIOD:g} s"
            ),
        )
    if len(scenario.fingers) > 2 and scenario.controller.grasp_force == "minimum":
        yield FieldError(
            field="controller.grasp_force",
            value="minimum",
            limit="none for more than two fingers",
            message=(
                "controller.grasp_force 'minimum' is available for two fingers; use 'none' for more"
            ),
        )
