"""Suggestions after a run, in the order of their success in random runs.

``python -m benchmarks hints`` measures this order (docs/verification.md). Without trials only the
first few are shown: for a lost object those that held most often, for a held one those that never
lost it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.custom_laws import LAW_PARAMETERS, law_parameters
from slipgrasp.core.scenario.law_choice import missing_bounds
from slipgrasp.core.words.hints import Situation
from slipgrasp.core.words.misbelief import turns, worst_beliefs
from slipgrasp.core.words.options import (
    Option,
    believe_the_truth,
    lower,
    raise_,
    sample_at_1_khz,
    set_to,
    use_law,
)
from slipgrasp.core.words.phrases import joined

_NEARLY_ALL = 1.0 - 1e-6
_STIFFNESS, _DAMPING = 100.0, 20.0  # critically damped
_PERIOD = 0.001  # [s]
_INSIDE = 1.05
"""Grip safety with which a torque held for one period keeps its contact in stick."""


def hold(situation: Situation) -> Iterator[Option]:
    """Suggestions that held lost objects, the most successful first."""
    laws = list(change_law(situation))
    yield from laws[:2]
    yield from share_forces(situation)
    yield from start_nearer_to_the_truth(situation)
    yield from leave_the_cones(situation)
    yield from give_more_torque(situation)
    yield from act_sooner(situation)
    yield from squeeze_harder(situation)
    yield from laws[2:]
    yield from bound_estimates(situation)
    yield from (option for option in stop_slip_earlier(situation) if not option.values)


def slip_less(situation: Situation) -> Iterator[Option]:
    """Suggestions that reduced the slip of held objects but may lose one; only after a trial."""
    yield from change_law(situation)
    yield from stop_slip_earlier(situation)
    yield from squeeze_harder(situation)
    yield from start_nearer_to_the_truth(situation)
    yield from share_forces(situation)
    yield from act_sooner(situation)


def come_nearer(situation: Situation) -> Iterator[Option]:
    """Suggestions that moved held objects closer but may lose one; only after a trial."""
    yield from start_nearer_to_the_truth(situation)
    yield from raise_(situation.scenario, situation.law.gains[0])
    yield from change_law(situation)
    yield from squeeze_harder(situation)


def change_law(situation: Situation) -> Iterator[Option]:
    """Suggests the law that holds most objects, if another is used: firm, and with defaults."""
    present = situation.controller
    if present.kind == "composite":
        return
    law = use_law("composite")
    settings: tuple[tuple[str, float | str | bool, str], ...] = (
        *[("prediction", True, "")] * (present.latency > 0.0),
        ("position_gain", _STIFFNESS, "1/s²"),
        ("velocity_gain", _DAMPING, "1/s"),
        ("grasp_force", "minimum", ""),
    )
    firm = [
        set_to(f"controller.{name}", value, unit)
        for name, value, unit in settings
        if getattr(present, name) != value
    ]
    yield from [law.with_(*firm)] * bool(firm)
    yield law
    for more in (*give_more_torque(situation), *start_nearer_to_the_truth(situation)):
        yield law.with_(*firm, more)


def share_forces(situation: Situation) -> Iterator[Option]:
    """Suggests all forces inside their cones, if slipping contacts are on their cones."""
    if situation.law.uses_friction and situation.controller.distribution != "hold":
        yield set_to("controller.distribution", "hold")


def leave_the_cones(situation: Situation) -> Iterator[Option]:
    """Suggests forces slightly inside their cones, if sampled torques put them on the edge."""
    controller = situation.controller
    if situation.law.uses_friction and controller.control_period and controller.grip_safety == 1.0:
        yield set_to("controller.grip_safety", _INSIDE)


def give_more_torque(situation: Situation) -> Iterator[Option]:
    """Suggests higher torque limits, if there are limits."""
    for key in ("actuation.torque_limit", "actuation.torque_rate_limit"):
        if getattr(situation.scenario.actuation, key.rpartition(".")[2]) is not None:
            yield from raise_(situation.scenario, key)
    if situation.exhausted is not None and situation.scenario.actuation.torque_limit is None:
        yield from raise_(situation.scenario, situation.exhausted[1])


def act_sooner(situation: Situation) -> Iterator[Option]:
    """Suggests less delay between events and torques, or a prediction that compensates it."""
    scenario, controller = situation.scenario, situation.controller
    if controller.control_period == 0.0:
        return
    if controller.latency > 0.0:
        if situation.law.uses_friction and not controller.prediction:
            yield set_to("controller.prediction", True)
        yield from lower(scenario, "controller.latency")
    if controller.control_period > _PERIOD:
        yield sample_at_1_khz()
    if not scenario.sensing.true_phases and scenario.sensing.slip_delay > 0.0:
        yield from lower(scenario, "sensing.slip_delay")


def squeeze_harder(situation: Situation) -> Iterator[Option]:
    """Suggests settings that let the law press the fingertips harder."""
    scenario, controller = situation.scenario, situation.controller
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
    """Suggests settings that end a slip sooner."""
    for key in situation.law.stops_slip_with:
        yield from raise_(situation.scenario, key)
    own = [f"{LAW_PARAMETERS}.{name}" for name in law_parameters(situation.controller.kind)]
    if own:
        yield Option(f"change a parameter that the law declares ({joined(own)})")


def start_nearer_to_the_truth(situation: Situation) -> Iterator[Option]:
    """Suggests other values for the initial estimates with the largest errors."""
    start = situation.start
    believed = [estimate.initial for estimate in start.estimates]
    true = [_true_value(start, estimate.parameter) for estimate in start.estimates]
    found = worst_beliefs(situation.scenario, believed, true, turns=turns(situation.last))
    yield from believe_the_truth(start, {k: true[k] for k in sorted(found)})


def sample_control(situation: Situation) -> Iterator[Option]:
    """Suggests sampled control, if control is continuous."""
    if situation.controller.control_period == 0.0:
        yield sample_at_1_khz()


def bound_estimates(situation: Situation) -> Iterator[Option]:
    """Suggests physical bounds for the estimates of a learning law that lack them.

    If no physical bounds fit, the suggestion is only text, first for the smallest estimate.
    """
    estimates, values = situation.scenario.estimates, situation.last.estimates[0]
    missing = {
        k: [bound for bound in ("minimum", "maximum") if getattr(estimate, bound) is None]
        for k, estimate in enumerate(estimates)
    }
    open_ends = {k: bounds for k, bounds in missing.items() if bounds}
    if situation.law.learns and open_ends:
        lowest = min(open_ends, key=lambda k: values[k])
        first = joined([f"estimates.{lowest}.{bound}" for bound in open_ends[lowest]])
        words = f"give the estimates bounds ({first} first)"
        bounds = dict(missing_bounds(situation.start))
        yield Option(words, bounds, "physical bounds for all estimates" * bool(bounds))


def _true_value(scenario: Scenario, key: str) -> float:
    """Value of a parameter that can be estimated [SI]."""
    value: Any = scenario
    for part in key.split("."):
        value = value[int(part)] if isinstance(value, tuple) else getattr(value, part)
    assert isinstance(value, (int, float)), "only numbers can be estimated"
    return float(value)
