"""Definition of a study: a base scenario and its variations, with every run given by its index.

Nothing is expanded: the number of runs is computed, and runs are created on demand.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.chosen_laws import kinds_in
from slipgrasp.core.scenario.custom_laws import LAW, CustomLaw, LawIdentity, custom_law
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.study.sampling import unit_samples

MAX_RUNS = 1_000_000

Value = float | int | str | bool | tuple[float, ...] | None
"""Possible values of a parameter."""

Method = Literal["grid", "list", "random", "latin-hypercube"]
KeptRecordings = Literal["all", "ended-early", "none"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """Variation of one parameter: over chosen values, or between two bounds.

    Attributes:
        key: Dotted key of the parameter; ``*`` stands for every finger or estimate.
        values: Its values, combined with all others; None for a range.
        minimum: Lower bound of a range, in the unit of the parameter.
        maximum: Upper bound of a range, in the unit of the parameter.
        count: Number of grid values in the range, including both bounds.
        scale: Whether a range is divided or sampled linearly or logarithmically.
        integer: Whether the parameter takes integers only.
    """

    key: str
    values: tuple[Value, ...] | None = None
    minimum: float | None = None
    maximum: float | None = None
    count: int | None = None
    scale: Literal["linear", "log"] = "linear"
    integer: bool = False

    @property
    def is_range(self) -> bool:
        """Whether it is a range."""
        return self.values is None

    def value_at(self, share: float) -> float | int:
        """The value of a range at a fraction of the way from its lower to its upper bound."""
        assert self.minimum is not None and self.maximum is not None
        low, high = self.minimum, self.maximum
        if self.integer:
            return min(int(low) + math.floor(share * (high - low + 1)), int(high))
        if share in (0.0, 1.0):
            return high if share else low
        if self.scale == "log":
            return low * (high / low) ** share
        return low + share * (high - low)

    def grid_value(self, place: int) -> Value:
        """The value at an index of the grid."""
        if self.values is not None:
            return self.values[place]
        assert self.count is not None
        share = place / (self.count - 1) if self.count > 1 else 0.0
        if self.integer:
            assert self.minimum is not None and self.maximum is not None
            return round(self.minimum + share * (self.maximum - self.minimum))
        return self.value_at(share)

    @property
    def grid_size(self) -> int:
        """The number of its values in a grid."""
        return len(self.values) if self.values is not None else self.count or 0


class Sampling(BaseModel):
    """Selection of the runs."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False, frozen=True)

    method: Annotated[
        Method,
        Field(
            description="grid: every combination; list: `runs` one by one; random and "
            "latin-hypercube: samples between min and max"
        ),
    ] = "grid"
    runs: Annotated[
        int | None, Field(ge=1, le=10**15, description="number of samples; not for a grid or list")
    ] = None
    seed: Annotated[
        int,
        Field(
            ge=0, le=2**53 - 1, description="seed of the samples; equal seeds give equal samples"
        ),
    ] = 0


@dataclass(frozen=True, kw_only=True)
class Study:
    """A base scenario, its variations, and the recordings to store.

    The runs are numbered from 0: samples, or items of the list, in order, and within each of them
    the combinations of values, with the last axis varying fastest. A grid is one sample.

    Attributes:
        title: Description in a sentence.
        base: The base scenario.
        base_name: Name of the preset of the base, empty if there is none.
        axes: Varied parameters.
        sampling: Selection of the runs.
        listed: The runs of a list, each as values by dotted key.
        recordings: Runs whose recording is stored.
        limits: Largest magnitude of metrics, as in `slipgrasp.core.study.limits`.
        computed_by: Custom laws that computed it, if it was read from its file.
    """

    base: Scenario
    sampling: Sampling
    axes: tuple[Axis, ...] = ()
    listed: tuple[Mapping[str, Value], ...] = ()
    recordings: KeptRecordings = "none"
    limits: Mapping[str, float] = field(default_factory=dict)
    title: str = ""
    base_name: str = ""
    computed_by: tuple[LawIdentity, ...] = ()

    @property
    def num_runs(self) -> int:
        """Number of runs."""
        return self.num_samples * self.num_combinations

    @property
    def num_samples(self) -> int:
        """Number of samples, or items of the list; 1 for a grid."""
        if self.sampling.method == "grid":
            return 1
        return len(self.listed) if self.sampling.method == "list" else self.sampling.runs or 0

    @cached_property
    def num_combinations(self) -> int:
        """Number of combinations of values for each sample."""
        return math.prod(axis.grid_size for axis in self.crossed_axes)

    @cached_property
    def crossed_axes(self) -> tuple[Axis, ...]:
        """The axes whose values are combined for each sample."""
        if self.sampling.method == "grid":
            return self.axes
        return tuple(axis for axis in self.axes if not axis.is_range)

    @cached_property
    def sampled_axes(self) -> tuple[Axis, ...]:
        """The axes with one value per sample."""
        if self.sampling.method == "grid":
            return ()
        return tuple(axis for axis in self.axes if axis.is_range)

    @cached_property
    def keys(self) -> tuple[str, ...]:
        """Varied parameters by dotted key."""
        listed = dict.fromkeys(key for run in self.listed for key in run)
        return (*listed, *(axis.key for axis in self.axes))

    def values_of(self, index: int) -> dict[str, Value]:
        """Values that a run sets, by dotted key.

        Args:
            index: Index of the run, from 0 to `num_runs` - 1.

        Raises:
            IndexError: If the run does not exist.
        """
        if not 0 <= index < self.num_runs:
            raise IndexError(f"run {index} of a study with {self.num_runs} runs")
        sample, place = divmod(index, self.num_combinations)
        crossed: dict[str, Value] = {}
        for axis in reversed(self.crossed_axes):
            place, digit = divmod(place, axis.grid_size)
            crossed[axis.key] = axis.grid_value(digit)
        found = crossed | self._sampled(sample)
        return {key: found[key] for key in self.keys if key in found}

    def _sampled(self, sample: int) -> dict[str, Value]:
        if self.sampling.method == "list":
            return dict(self.listed[sample])
        if not self.sampled_axes:
            return {}
        shares = self._shares[sample].tolist()
        return {
            axis.key: axis.value_at(share)
            for axis, share in zip(self.sampled_axes, shares, strict=True)
        }

    @property
    def varied_laws(self) -> tuple[str, ...]:
        """The control laws that its runs set, without repetition."""
        varied = [v for axis in self.axes if axis.key == LAW for v in axis.values or ()]
        listed = [run[LAW] for run in self.listed if LAW in run]
        return tuple(dict.fromkeys(map(str, (*varied, *listed))))

    def custom_laws(self) -> tuple[CustomLaw, ...]:
        """The loaded custom laws that its runs may use."""
        kinds = dict.fromkeys((*kinds_in(self.base), *self.varied_laws))
        return tuple(law for law in map(custom_law, kinds) if law is not None)

    @property
    def _shares(self) -> NDArray[np.float64]:
        assert self.sampling.runs is not None
        return unit_samples(
            self.sampling.method, self.sampling.runs, len(self.sampled_axes), self.sampling.seed
        )

    def scenario_of(self, index: int) -> Scenario:
        """The scenario of a run.

        Raises:
            ScenarioError: If its values, or their combination, are not allowed.
            IndexError: If the run does not exist.
        """
        return apply_values(self.base, self.values_of(index))


def apply_values(base: Scenario, values: Mapping[str, Value]) -> Scenario:
    """Returns a base with the values of a run of a study.

    Raises:
        ScenarioError: If the values, or their combination, are not allowed.
    """
    return with_values(
        base, {one: value for key, value in values.items() for one in expand_key(base, key)}
    )


def expand_key(base: Scenario, key: str) -> tuple[str, ...]:
    """Expands a key with ``*`` to one key per finger, estimate or timed change.

    If the base has none, the key is returned unchanged, and is then unknown.
    """
    head, star, tail = key.partition(".*")
    if not star or head not in ("fingers", "estimates", "changes"):
        return (key,)
    return tuple(f"{head}.{index}{tail}" for index in range(len(getattr(base, head)))) or (key,)
