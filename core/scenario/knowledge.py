"""Parameters of the hand and the object that the control law of a run knows or does not know."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from slipgrasp.core.scenario import HandScenario, Scenario
from slipgrasp.core.scenario.chosen_laws import kinds_in
from slipgrasp.core.scenario.custom_laws import law_of
from slipgrasp.core.scenario.scenario import FreeScenario
from slipgrasp.core.scenario.unknowns import mass_keys

Varied = Mapping[str, Collection[Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Knowledge:
    """The parameters of the hand and the object that a controller does not know.

    All other parameters are given to every control law, including custom ones, with their true
    values at every instant, including timed changes and patches
    (`slipgrasp.core.kernel.planar.law.believe`). Pushes and sensor errors are not parameters of the
    hand or the object.

    Attributes:
        estimated: Keys of the estimated parameters.
        mistaken: Keys of the parameters that its model has wrong or lacks at some time: links with
            wrong mass or length ratios, static friction that differs from sliding friction, joint
            friction.
        uses_friction: Whether its law may use friction, as custom laws may.
        uses_object: Whether its law uses parameters of the object.
    """

    estimated: tuple[str, ...]
    mistaken: tuple[str, ...]
    uses_friction: bool
    uses_object: bool = True

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Keys of all unknown parameters."""
        return (*self.estimated, *self.mistaken)

    @property
    def told(self) -> bool:
        """Whether all parameters are known."""
        return not self.unknowns

    def to_mapping(self) -> dict[str, Any]:
        """The keys and `told` as plain values for JSON."""
        return {"unknowns": list(self.unknowns), "told": self.told}


def knowledge_of(scenario: Scenario, varied: Varied | None = None) -> Knowledge:
    """Returns the knowledge of the controller of a run.

    Args:
        scenario: The scenario of the run.
        varied: Other values of parameters by key, in the runs of a study; a parameter is unknown if
            it is unknown in any run.
    """
    if isinstance(scenario, FreeScenario):
        return Knowledge(estimated=(), mistaken=(), uses_friction=False, uses_object=False)
    values = _Values(scenario, varied or {})
    estimated = dict.fromkeys(
        str(key)
        for k, estimate in enumerate(scenario.estimates)
        for key in values.of(f"estimates.{k}.parameter", estimate.parameter)
    )
    mistaken = (key for key in _mistaken(scenario, values) if key not in estimated)
    kinds = (*kinds_in(scenario), *values.of("controller.kind", scenario.controller.kind))
    laws = [law_of(str(kind)) for kind in kinds]
    return Knowledge(
        estimated=tuple(estimated),
        mistaken=tuple(mistaken),
        uses_friction=any(law.uses_friction or law.is_own for law in laws),
        uses_object=not all(law.holds_tips for law in laws),
    )


@dataclass(frozen=True, slots=True)
class _Values:
    """All values of parameters in a run, or in the runs of a study."""

    scenario: Scenario
    varied: Varied

    def of(self, key: str, present: Any) -> list[Any]:
        """The values of a parameter.

        Args:
            key: Its dotted key.
            present: Value in the scenario.
        """
        later = [change.value for change in self.scenario.changes if change.parameter == key]
        return [*self.varied.get(key, (present,)), *later]


def _length_keys(scenario: HandScenario, finger: int) -> tuple[str, ...]:
    """Dotted keys of the link lengths of a finger."""
    has_links = scenario.fingers[finger].kind == "links"
    count = len(scenario.fingers[finger].link_lengths) if has_links else 0
    return tuple(f"fingers.{finger}.link_lengths.{link}" for link in range(count))


def _mistaken(scenario: HandScenario, values: _Values) -> Iterator[str]:
    """Keys of wrong or missing parameters in the model of the law; see `Knowledge.mistaken`."""
    for ratio, keys_of in (("link_mass_ratio", mass_keys), ("link_length_ratio", _length_keys)):
        key = f"controller.{ratio}"
        if any(value != 1.0 for value in values.of(key, getattr(scenario.controller, ratio))):
            for i in range(len(scenario.fingers)):
                yield from keys_of(scenario, i)
    for i, finger in enumerate(scenario.fingers):
        static = values.of(f"fingers.{i}.static_friction", finger.static_friction)
        kinetic = values.of(f"fingers.{i}.friction", finger.friction)
        if any(one not in (None, other) for one in static for other in kinetic):
            yield f"fingers.{i}.static_friction"
        for name in ("joint_damping", "joint_friction"):
            key = f"fingers.{i}.{name}"
            if any(value != 0.0 for value in values.of(key, getattr(finger, name))):
                yield key
