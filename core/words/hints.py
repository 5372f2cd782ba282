"""What to try next: only what the control law uses and what is not so already.

Every hint is a list of options, each of which names parameters by their dotted keys, with the
present value where a larger or a smaller one is meant. Where a scenario leaves none of them open,
the hint says what is left outside the controller.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from slipgrasp.core.scenario import ControlLaw, ControllerParameters, Scenario
from slipgrasp.core.scenario.loading import parameter_definitions, with_values
from slipgrasp.core.scenario.own_laws import LAW_PARAMETERS, law_of, law_parameters
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.words.misbelief import turns, worst_beliefs
from slipgrasp.core.words.options import (
    Option,
    believe_the_truth,
    raise_,
    sample_at_1_khz,
    set_to,
    use_law,
)
from slipgrasp.core.words.phrases import joined

_NEARLY_ALL = 1.0 - 1e-6
_OUTSIDE = "no setting of this law is left to try: make the object lighter or its faces rougher"


@dataclass(frozen=True, slots=True)
class Hint:
    """What to try next.

    Attributes:
        options: Any of them.
        purpose: What they are for, such as ``for less slip``; empty if that is plain.
        instead: What could be done outside the controller; empty if there is nothing else.
    """

    options: tuple[Option, ...]
    purpose: str = ""
    instead: str = ""

    def __str__(self) -> str:
        """The hint as a sentence without its capital letter and full stop."""
        options = joined([option.words for option in self.options], "or")
        told = ", ".join(filter(None, [options, self.purpose]))
        return "; or ".join(filter(None, [told, self.instead]))

    @property
    def trials(self) -> tuple[Option, ...]:
        """The options that can be followed as they stand."""
        return tuple(option for option in self.options if option.values)

    @property
    def rest(self) -> Hint:
        """What it says besides the trials and their purpose."""
        return Hint(tuple(option for option in self.options if not option.values), "", self.instead)


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """Where a run stands when something is to be tried.

    Attributes:
        start: The scenario as the run began.
        scenario: The scenario with the timed changes so far.
        last: Trace of the last row.
    """

    start: Scenario
    scenario: Scenario
    last: Trace

    @property
    def controller(self) -> ControllerParameters:
        """The controller of that time."""
        return self.scenario.controller

    @property
    def law(self) -> ControlLaw:
        """Facts about its law."""
        return law_of(self.controller.kind)

    @property
    def is_torque_limited(self) -> bool:
        """Whether a joint gives all that it may."""
        limit = self.scenario.actuation.torque_limit
        return limit is not None and np.abs(self.last.joint_torque[0]).max() >= limit


def scenario_at(scenario: Scenario, time: float) -> Scenario:
    """A scenario with the timed changes before some time, and without those to come [s]."""
    due = sorted((c for c in scenario.changes if c.time < time), key=lambda change: change.time)
    values = {c.parameter: list(c.value) if isinstance(c.value, tuple) else c.value for c in due}
    return with_values(replace(scenario, changes=()), values, with_law=False)


def any_of(
    *options: Iterable[Option], otherwise: str = _OUTSIDE, purpose: str = "", instead: str = ""
) -> Hint:
    """A hint to try any of some options, each once.

    Args:
        options: Each of them none, one or several.
        otherwise: The hint where there is none.
        purpose: What they are for.
        instead: What could be done besides.
    """
    found = {option.words: option for several in options for option in several}
    if found:
        return Hint(tuple(found.values()), purpose, instead)
    return Hint((), instead=instead) if instead else Hint((Option(otherwise),), purpose)


def squeeze_harder(situation: Situation) -> Iterator[Option]:
    """What lets the law press the fingertips harder against the object."""
    scenario, controller = situation.scenario, situation.controller
    if situation.is_torque_limited:
        yield from raise_(scenario, "actuation.torque_limit")
    if situation.law.is_own:
        return
    most, key = controller.maximum_normal_force, "controller.maximum_normal_force"
    is_bounded = most is not None and situation.last.normal_force[0].max() >= _NEARLY_ALL * most
    if is_bounded:
        yield from raise_(scenario, key)
    elif situation.law.uses_friction and controller.grasp_force == "none":
        yield set_to("controller.grasp_force", "minimum")
    elif most is None or situation.law.uses_friction or controller.grip_force < most:
        yield from raise_(scenario, situation.law.holds_with)
    else:
        yield from raise_(scenario, key)


def stop_slip_earlier(situation: Situation) -> Iterator[Option]:
    """What lets the law end a slip sooner."""
    for key in situation.law.stops_slip_with:
        yield from raise_(situation.scenario, key)
    own = [f"{LAW_PARAMETERS}.{name}" for name in law_parameters(situation.controller.kind)]
    if own:
        yield Option(f"change what the law itself declares ({joined(own)})")


def start_nearer_to_the_truth(situation: Situation) -> Iterator[Option]:
    """The beliefs at the start that were farthest from what was true then."""
    start = situation.start
    definitions = parameter_definitions(start)
    believed = [estimate.initial for estimate in start.estimates]
    true = [_number(definitions[estimate.parameter].value) for estimate in start.estimates]
    found = worst_beliefs(situation.scenario, believed, true, turns=turns(situation.last))
    yield from believe_the_truth(start, {k: true[k] for k in sorted(found)})


def change_law(situation: Situation) -> Iterator[Option]:
    """The law that holds what the others drop, where it is another."""
    if situation.controller.kind != "composite":
        yield use_law("composite")


def sample_control(situation: Situation) -> Iterator[Option]:
    """Sampled control, where control is continuous."""
    if situation.controller.control_period == 0.0:
        yield sample_at_1_khz()


def bound_estimates(situation: Situation) -> Iterator[Option]:
    """Bounds that a learning law lacks, first for the estimate that went lowest."""
    estimates, values = situation.scenario.estimates, situation.last.estimates[0]
    missing = {
        k: [
            f"estimates.{k}.{bound}"
            for bound in ("minimum", "maximum")
            if getattr(estimate, bound) is None
        ]
        for k, estimate in enumerate(estimates)
    }
    open_ends = [k for k, bounds in missing.items() if bounds]
    if situation.law.learns and open_ends:
        lowest = min(open_ends, key=lambda k: values[k])
        yield Option(f"give the estimates bounds ({joined(missing[lowest])} first)")


def _number(value: object) -> float:
    assert isinstance(value, (int, float)), "only numbers can be estimated"
    return float(value)
