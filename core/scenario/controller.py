"""The control law and what it does not know."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le, Len
from pydantic.dataclasses import dataclass

from core.parameters import Quantity
from core.scenario.field_types import CONFIG, Gain, PositiveGain

__all__ = ["ControllerParameters", "Estimate"]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class ControllerParameters:
    """The control law, its gains and how it meets the plant."""

    kind: Annotated[
        Literal["theorem-3", "theorem-4"],
        Quantity("Adaptive law: theorem-3, or theorem-4 with sigma-modification.", changeable=True),
    ] = "theorem-4"
    control_period: Annotated[
        float,
        Ge(0.0),
        Le(0.1),
        Quantity(
            "Time between control updates; 0 = continuous control, else at least 0.0001 s.",
            "s",
            typical=(0.0, 0.01),
            changeable=True,
        ),
    ] = 0.001
    recognition_time: Annotated[
        float,
        Ge(1e-5),
        Le(0.1),
        Quantity(
            "How long continuous control keeps its belief where no phase is consistent.",
            "s",
            typical=(0.0001, 0.01),
            changeable=True,
        ),
    ] = 0.001
    position_gain: Annotated[
        Gain | Annotated[tuple[Gain, ...], Len(3, 3)],
        Quantity(
            "K_p: one number for the object, or one per coordinate x, y, theta; slip has none.",
            "1/s^2",
            typical=(10.0, 400.0),
            changeable=True,
        ),
    ] = 100.0
    velocity_gain: Annotated[
        PositiveGain | tuple[PositiveGain, ...],
        Quantity(
            "K_v: one number, or one per coordinate x, y, theta and slip of each contact.",
            "1/s",
            typical=(2.0, 50.0),
            changeable=True,
        ),
    ] = 10.0
    adaptation_gain: Annotated[
        PositiveGain | tuple[PositiveGain, ...],
        Quantity(
            "Gamma: speed of adaptation, one number or one per unknown.",
            "1",
            typical=(0.05, 10.0),
            changeable=True,
        ),
    ] = 1.28
    lyapunov_weight: Annotated[
        Gain | tuple[Gain, ...],
        Quantity(
            "Q: weight of the errors in the Lyapunov function, a number times the identity or one "
            "per coordinate x, y, theta and slip of each contact.",
            "1",
            typical=(1.0, 100.0),
            changeable=True,
        ),
    ] = 20.0
    grasp_force: Annotated[
        Literal["minimum", "none"],
        Quantity(
            "Internal force: minimum inside the estimated friction cones, or none (y = 0).",
            changeable=True,
        ),
    ] = "minimum"
    grip_safety: Annotated[
        float,
        Ge(1.0),
        Le(10.0),
        Quantity(
            "Factor by which the commanded force stays inside the estimated cones.",
            "1",
            typical=(1.0, 2.0),
            changeable=True,
        ),
    ] = 1.1
    estimate_norm_bound: Annotated[
        float,
        Gt(0.0),
        Le(1e6),
        Quantity(
            "phi_0: norm of the estimates above which theorem-4 pulls them back.",
            "1",
            typical=(0.5, 5.0),
            changeable=True,
        ),
    ] = 2.036


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class Estimate:
    """One parameter the controller does not know."""

    parameter: Annotated[str, Len(1, 80), Quantity("Dotted key of the unknown parameter.")]
    initial: Annotated[
        float,
        Ge(-1e3),
        Le(1e3),
        Quantity(
            "What the controller believes at the start, in the unit of the parameter.",
            "",
            changeable=True,
        ),
    ]
    minimum: Annotated[
        float | None,
        Ge(-1e3),
        Le(1e3),
        Quantity("Least value the estimate may take; none if left out.", "", changeable=True),
    ] = None
    maximum: Annotated[
        float | None,
        Ge(-1e3),
        Le(1e3),
        Quantity("Largest value the estimate may take; none if left out.", "", changeable=True),
    ] = None
