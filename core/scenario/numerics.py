"""Duration, output and accuracy of a run, and changes of parameters."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Interval, Len
from pydantic import AfterValidator
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.field_types import CONFIG
from slipgrasp.core.scenario.laws import law_kind
from slipgrasp.core.scenario.parameters import Quantity

MAX_CHATTER_CHANGES = 10_000


Duration = Annotated[float, Interval(ge=1e-3, le=600.0), Quantity("Simulated time.", "s")]
OutputRate = Annotated[
    float, Interval(ge=1.0, le=1e4), Quantity("Rate of the samples in the trace.", "Hz")
]
Gravity = Annotated[float, Interval(ge=0.0, le=100.0)]
RelativeTolerance = Annotated[
    float, Interval(ge=1e-12, le=1e-3), Quantity("Relative error allowed in one step.", "1")
]
AbsoluteTolerance = Annotated[
    float,
    Interval(ge=1e-14, le=1e-3),
    Quantity("Absolute error allowed in one step, SI units.", ""),
]
MaxStep = Annotated[
    float, Interval(ge=1e-5, le=1.0), Quantity("Largest step of the integration.", "s")
]
MaxSteps = Annotated[
    int,
    Interval(ge=1, le=100_000_000),
    Quantity("Number of steps after which a run ends with the outcome limit.", "1"),
]
ChatterChanges = Annotated[
    int,
    Interval(ge=5, le=MAX_CHATTER_CHANGES),
    Quantity("Number of phase changes within the chatter window that ends a run.", "1"),
]
ChatterWindow = Annotated[
    float,
    Interval(ge=1e-6, le=10.0),
    Quantity(
        "Length of the chatter window; under sampled control at most one control period.", "s"
    ),
]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class Change:
    """A parameter that changes at a given time during the run."""

    time: Annotated[float, Interval(gt=0.0, le=600.0), Quantity("Time of the change.", "s")]
    parameter: Annotated[str, Len(1, 80), Quantity("Dotted key of the parameter that changes.")]
    value: Annotated[
        bool | float | str | tuple[float, ...],
        AfterValidator(law_kind),
        Quantity("New value, in the unit of the parameter."),
    ]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class Simulation:
    """Duration, output, gravity and accuracy of the integration; subclasses describe gravity."""

    duration: Duration = 7.0
    output_rate: OutputRate = 200.0
    gravity: float
    relative_tolerance: RelativeTolerance = 1e-8
    absolute_tolerance: AbsoluteTolerance = 1e-10
    max_step: MaxStep = 0.1
    max_steps: MaxSteps = 5_000_000
    seed: Annotated[
        int,
        Interval(ge=0, le=2**31 - 1),
        Quantity("Seed of the sensor noise: equal seeds give equal runs.", "1"),
    ] = 0
    chatter_changes: ChatterChanges = 100
    chatter_window: ChatterWindow = 0.15


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SimulationParameters(Simulation):
    """Duration, output, gravity and accuracy of the integration."""

    gravity: Annotated[Gravity, Quantity("Gravitational acceleration along -y.", "m/s²")] = 9.81


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialSimulation(Simulation):
    """Duration, output, gravity, kind of friction and accuracy of the integration."""

    gravity: Annotated[Gravity, Quantity("Gravitational acceleration along -z.", "m/s²")] = 9.81
    friction: Annotated[
        Literal["cone", "pyramid"],
        Quantity(
            "Friction of a contact along its two tangents: cone (Coulomb's law) or pyramid (as in "
            "the paper, with independent bounds for the two tangential forces)."
        ),
    ] = "cone"
