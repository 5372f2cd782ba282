"""What random scenarios vary: a factor with a few levels for everything that can be set.

Factors follow from the definitions of the parameters, so that a new parameter joins by itself. A
number takes its default, the ends of the range in which a slider moves, something inside, and
zero where it may be zero; a choice each of its words. Parameters that only make sense together
(where fingers stand, which estimates there are, when things happen) are drawn by
`tests.core.drawn_pairs`, of which factors of its own say how.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum, auto
from fnmatch import fnmatchcase
from functools import cache
from random import Random
from typing import Any

from slipgrasp.core.scenario.parameters import Parameter, describe
from slipgrasp.core.scenario.scenario import full_scenario
from slipgrasp.core.scenario.space import SPACES


class Where(Enum):
    """A number or list among those that a parameter may be."""

    DEFAULT = auto()
    NONE = auto()  # left out
    ZERO = auto()
    LOW = auto()
    HIGH = auto()
    INSIDE = auto()
    LIST = auto()  # one number for each of something


Level = Where | str | bool | int

APART = (
    *("fingers.*.joints.*", "fingers.*.tip.*", "fingers.*.attitude*", "fingers.*.posture.*"),
    *("fingers.*.pad_radius", "fingers.*.pad_pressure"),
    *("object.shape", "object.radius"),
)
"""Parameters of chains, soft pads and round objects, not drawn here: they have tests of their own.

Most of what is drawn goes not together with soft pads; the references know flat faces alone.
"""

TOGETHER = (
    "title",
    *("object.half_*", "object.face_half_length", "object.height", "object.corners.*"),
    *("fingers.*.base.*", "fingers.*.face", "fingers.*.contact_offset*"),
    "fingers.*.link_lengths.*",
    *APART,
    *("trajectory.start.*", "trajectory.set_points.*", "trajectory.table.*"),
    *("controller.lyapunov_matrix.*", "estimates.*", "changes.*"),
    *("pulses.*.time", "patches.*.face", "patches.*.start_time", "patches.*.end_time"),
    *("simulation.duration", "simulation.max_steps", "simulation.seed"),
)
"""Patterns of the parameters that are drawn together with others, or bound the cost of a run."""

WITHOUT_LEVELS = {"fingers.*.kind": ("chain", "slides")}
"""Words that are not drawn: the references that judge random runs know no slides, and planar chains
have draws of their own (`tests.core.drawn_chains`)."""

RANGES: Mapping[str, tuple[float, float]] = {
    # Three principal inertias that a body can have.
    "object.inertias.*": (0.006, 0.011),
    # Times the friction of slip, which is never more.
    "fingers.*.static_friction": (1.0, 1.5),
    "fingers.*.link_centre_fractions.*": (0.3, 0.7),
    "fingers.*.link_inertia_fractions.*": (0.05, 0.15),
    # Motions within the reach of the fingers, and quick enough to be seen in a short run.
    "trajectory.acceleration.*": (-0.5, 0.5),
    "trajectory.acceleration_time": (0.05, 0.1),
    "trajectory.coast_time": (0.0, 0.1),
    "trajectory.period": (0.1, 0.5),
    "trajectory.cycles": (1.0, 3.0),
    "trajectory.radius": (0.002, 0.02),
    "trajectory.angle": (-0.05, 0.05),
    "trajectory.angle.*": (-0.05, 0.05),
    "trajectory.amplitude.*": (-0.01, 0.01),
    # Shorter ones only cost time.
    "controller.control_period": (0.0005, 0.01),
    "controller.initial_deviation": (0.1, 5.0),
    "actuation.torque_limit": (10.0, 80.0),
    "actuation.torque_rate_limit": (50.0, 2000.0),
    "simulation.output_rate": (20.0, 2000.0),
    "simulation.gravity": (0.0, 20.0),
    # The checks are those of the default tolerances.
    "simulation.relative_tolerance": (1e-10, 1e-8),
    "simulation.absolute_tolerance": (1e-12, 1e-10),
    "simulation.max_step": (0.001, 0.1),
    "simulation.chatter_changes": (20, 200),
    "simulation.chatter_window": (0.01, 0.3),
    "pulses.*.duration": (0.005, 0.1),
    "pulses.*.force.*": (-5.0, 5.0),
    "pulses.*.moment": (-0.1, 0.1),
    "pulses.*.moment.*": (-0.1, 0.1),
    # Where fingertips may slide.
    "patches.*.centre": (-0.05, 0.05),
    "patches.*.centre.*": (-0.05, 0.05),
    "patches.*.half_length": (0.002, 0.05),
    "patches.*.radius": (0.0005, 0.05),
}
"""Ranges where ``typical`` and the bounds are none that suit: a law asked to hold with friction
1e-67 commands forces that no tolerance fits, and P of Eq. 25 has no bound as K_p goes to zero."""

# Their defaults belong to runs of several seconds.
WITHOUT_DEFAULT = ("trajectory.acceleration_time", "trajectory.coast_time", "trajectory.period")


@dataclass(frozen=True, slots=True)
class Factor:
    """Something that is varied.

    Attributes:
        name: Pattern of the keys of a parameter, an asterisk for every index; or another name.
        levels: What it may be.
        range: Of a number.
        default: Value of the parameter that is left out.
        size: Of a list of fixed length; None for a single value.
        is_integer: Whether it is a whole number.
        is_changeable: Whether a timed change may set it.
    """

    name: str
    levels: tuple[Level, ...]
    range: tuple[float, float] = (0.0, 0.0)
    default: Any = None
    size: int | None = None
    is_integer: bool = False
    is_changeable: bool = False

    def value(self, level: Level, rng: Random) -> Any:
        """The parameter at one of its levels.

        Args:
            level: Which, but for `Where.LIST`.
            rng: Draws what lies inside a range.
        """
        if level == Where.DEFAULT:
            return self.default
        if self.size is None:
            return self.single_value(level, rng)
        return tuple(self.single_value(level, rng) for _ in range(self.size))

    def single_value(self, level: Level, rng: Random) -> Any:
        """One number of the parameter at a level other than `Where.DEFAULT`, or its word."""
        low, high = self.range
        if level == Where.INSIDE:
            return rng.randint(int(low), int(high)) if self.is_integer else rng.uniform(low, high)
        return {Where.ZERO: 0.0, Where.LOW: low, Where.HIGH: high, Where.NONE: None}.get(
            level, level
        )


def factors_of(definitions: Iterable[Parameter]) -> tuple[Factor, ...]:
    """A factor for every parameter that is not drawn together with others.

    Args:
        definitions: Of the parameters of a scenario with an entry in every list.
    """
    found: dict[str, list[Parameter]] = {}
    for parameter in definitions:
        found.setdefault(pattern_of(parameter.key), []).append(parameter)
    return tuple(_factor(name, same) for name, same in found.items() if not is_together(name))


@cache
def all_factors(spatial: bool) -> tuple[Factor, ...]:
    """The factors of the parameters of planar or spatial hands."""
    return factors_of(describe(full_scenario(SPACES[spatial])).values())


def pattern_of(key: str) -> str:
    """The name of the factor of a parameter: its key with an asterisk for every index."""
    return ".".join("*" if part.isdigit() else part for part in key.split("."))


def is_together(name: str) -> bool:
    """Whether parameters of this pattern are drawn with others."""
    return any(fnmatchcase(name, pattern) for pattern in TOGETHER)


def _factor(name: str, same: list[Parameter]) -> Factor:
    first = same[0]
    # Entries of a list, such as the fingers, have equal defaults.
    components = {p.key.rpartition(".")[2]: p.value for p in same}
    is_list = name.endswith(".*")
    return Factor(
        name=name,
        levels=tuple(_levels(name, first)),
        range=_range(name, first),
        default=tuple(components.values()) if is_list else first.value,
        size=len(components) if is_list else None,
        is_integer=first.kind == "integer",
        is_changeable=first.changeable,
    )


def _levels(name: str, parameter: Parameter) -> Iterator[Level]:
    """What a parameter may be; that which goes best with the others comes first."""
    if parameter.kind in ("boolean", "choice"):
        left_out = WITHOUT_LEVELS.get(name, ())
        words = [word for word in parameter.choices or (False, True) if word not in left_out]
        yield from sorted(words, key=lambda word: word != parameter.value)
        return
    low, high = _range(name, parameter)
    if name not in WITHOUT_DEFAULT:
        yield Where.NONE if parameter.value is None else Where.DEFAULT
    yield Where.INSIDE
    yield from (end for end, at in ((Where.LOW, low), (Where.HIGH, high)) if at != parameter.value)
    if parameter.minimum == 0.0 < low and not parameter.exclusive_minimum:
        yield Where.ZERO
    if parameter.kind == "number-or-list":
        yield Where.LIST


def _range(name: str, parameter: Parameter) -> tuple[float, float]:
    """Where a number is drawn; between 0 and 1 where nothing is said of it."""
    if (known := RANGES.get(name, parameter.typical)) is not None:
        return known
    low, high = parameter.minimum, parameter.maximum
    return 0.0 if low is None else low, 1.0 if high is None else high
