"""Duration, output and accuracy of a run, and changes of parameters."""

from __future__ import annotations

from typing import Annotated, Literal

from annotated_types import Ge, Gt, Le, Len
from pydantic import AfterValidator
from pydantic.dataclasses import dataclass

from slipgrasp.core.scenario.field_types import CONFIG
from slipgrasp.core.scenario.laws import law_kind
from slipgrasp.core.scenario.parameters import Quantity

MAX_CHATTER_CHANGES = 10_000


Duration = Annotated[float, Ge(1e-3), Le(600.0), Quantity("Simulated time.", "s")]
OutputRate = Annotated[float, Ge(1.0), Le(1e4), Quantity("Rate of the samples in the trace.", "Hz")]
PlanarGravity = Annotated[
    float, Ge(0.0), Le(100.0), Quantity("Gravitational acceleration along -y.", "m/s²")
]
SpatialGravity = Annotated[
    float, Ge(0.0), Le(100.0), Quantity("Gravitational acceleration along -z.", "m/s²")
]
RelativeTolerance = Annotated[
    float, Ge(1e-12), Le(1e-3), Quantity("Relative error allowed in one step.", "1")
]
AbsoluteTolerance = Annotated[
    float, Ge(1e-14), Le(1e-3), Quantity("Absolute error allowed in one step, SI units.", "")
]
MaxStep = Annotated[float, Ge(1e-5), Le(1.0), Quantity("Largest step of the integration.", "s")]
MaxSteps = Annotated[
    int,
    Ge(1),
    Le(100_000_000),
    Quantity("Number of steps after which a run ends with the outcome limit.", "1"),
]
Seed = Annotated[
    int,
    Ge(0),
    Le(2**31 - 1),
    Quantity("Seed of the sensor noise: equal seeds give equal runs.", "1"),
]
ChatterChanges = Annotated[
    int,
    Ge(5),
    Le(MAX_CHATTER_CHANGES),
    Quantity("Number of phase changes within the chatter window that ends a run.", "1"),
]
ChatterWindow = Annotated[
    float,
    Ge(1e-6),
    Le(10.0),
    Quantity(
        "Length of the chatter window; under sampled control at most one control period.", "s"
    ),
]
FrictionKind = Annotated[
    Literal["cone", "pyramid"],
    Quantity(
        "Friction of a contact along its two tangents: cone (Coulomb's law) or pyramid (as in the "
        "paper, with independent bounds for the two tangential forces).",
    ),
]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class Change:
    """A parameter that changes at a given time during the run."""

    time: Annotated[float, Gt(0.0), Le(600.0), Quantity("Time of the change.", "s")]
    parameter: Annotated[str, Len(1, 80), Quantity("Dotted key of the parameter that changes.")]
    value: Annotated[
        bool | float | str | tuple[float, ...],
        AfterValidator(law_kind),
        Quantity("New value, in the unit of the parameter."),
    ]


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SimulationParameters:
    """Duration, output, gravity and accuracy of the integration."""

    duration: Duration = 7.0
    output_rate: OutputRate = 200.0
    gravity: PlanarGravity = 9.81
    relative_tolerance: RelativeTolerance = 1e-8
    absolute_tolerance: AbsoluteTolerance = 1e-10
    max_step: MaxStep = 0.1
    max_steps: MaxSteps = 5_000_000
    seed: Seed = 0
    chatter_changes: ChatterChanges = 100
    chatter_window: ChatterWindow = 0.15


@dataclass(frozen=True, kw_only=True, slots=True, config=CONFIG)
class SpatialSimulation:
    """Duration, output, gravity, kind of friction and accuracy of the integration."""

    duration: Duration = 7.0
    output_rate: OutputRate = 200.0
    gravity: SpatialGravity = 9.81
    relative_tolerance: RelativeTolerance = 1e-8
    absolute_tolerance: AbsoluteTolerance = 1e-10
    max_step: MaxStep = 0.1
    max_steps: MaxSteps = 5_000_000
    seed: Seed = 0
    chatter_changes: ChatterChanges = 100
    chatter_window: ChatterWindow = 0.15
    friction: FrictionKind = "cone"
