"""Checks the effects of hints: those of random runs are applied, and the results are checked.

Half of the runs are random scenarios (`tests.core.drawn_scenarios`), half usual hands with random
objects, laws, delays, sensors and limits; planar and spatial. Every hint that is shown after a
trial is applied as on the page, and its text is compared with the new trace. The second table shows
the effect of every change without selection by trials, which determines the order of
`slipgrasp.core.words.cures`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from random import Random
from typing import Any, NamedTuple

import numpy as np

from benchmarks.random_runs import in_processes, reported
from benchmarks.report import Table, format_share
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.trying import Budget, follow, try_hint
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario import CONTROL_LAWS, Scenario
from slipgrasp.core.scenario.law_choice import LAW, with_law
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.scenario.space import SPATIAL
from slipgrasp.core.trace.types import ContactPhase, Outcome
from slipgrasp.core.words.hints import Goal
from slipgrasp.core.words.options import Option
from tests.core.drawn_hands_in_space import draw_hand_in_space
from tests.core.drawn_scenarios import draw_kind, draw_scenario

PRESSED = 600
MOST_RUNS = 2000
OPTIONS_OF = 200  # runs with trials of every change
SEED = 32
HOLD_WINDOW = 0.5  # [s]
DURATION = 1.5  # [s]
MAX_STEPS = 100_000

_PLANAR = ("paper-case-1", "paper-case-2", "composite-case-2", "three-fingers", "wide-object")
_SPATIAL = ("spatial-box", "spatial-composite", "spatial-prism", "spatial-unknown-friction")
_UNITS = {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "nm": 1e-9, "N": 1.0}
_LENGTH = r"([\d.]+ (?:mm|µm|nm)|less than 1 nm)"
_ROUNDED = 0.006
"""Allowed relative difference between a number in the text and that of a trace."""


class Press(NamedTuple):
    """A hint that was applied.

    Attributes:
        is_true: Whether its text was correct.
        holds: Whether the object was then held.
    """

    is_true: bool
    holds: bool


class Case(NamedTuple):
    """A random run and its hints.

    Attributes:
        held: Whether its object is held.
        presses: The displayed hints, applied.
        untried: Whether the first option without trials holds the object.
    """

    held: bool
    presses: tuple[Press, ...]
    untried: bool | None

    @property
    def is_true(self) -> bool:
        """Whether the texts of all displayed hints were correct."""
        return all(press.is_true for press in self.presses)


def run(seed: int = SEED) -> list[Table]:
    """The tables ``hints`` and ``hints-options``."""
    cases: list[Case] = []
    drawn = in_processes(partial(press_hints, seed), MOST_RUNS)
    for case in reported(drawn, MOST_RUNS, "hints", lambda case: not case.is_true):
        cases.append(case)
        if sum(len(case.presses) for case in cases) >= PRESSED:
            break
    drawn.close()
    options = in_processes(partial(follow_all, seed + 1), OPTIONS_OF)
    return [tabulate(cases, seed), tabulate_options(list(options))]


def press_hints(seed: int, index: int) -> Case:
    """Draws a run, tries its hint as the page does, and applies all that is displayed."""
    # Deferred: the page needs viser, which the other runs do not need.
    from slipgrasp.web.model.draft import Draft
    from slipgrasp.web.model.hints import followed

    scenario = draw(seed, index)
    before = simulate(scenario)
    hint = describe_run(before).hint
    draft = Draft.starting_from("drawn", scenario)
    tried = try_hint(before, hint, follow_option=lambda option: followed(draft, option).scenario())
    held, presses = is_held(before), []
    for each in tried.helpful:
        after = simulate(followed(draft, each.option).scenario())
        is_true = does_what_it_says(each.effect, before, after, hint.goal)
        others = follow(scenario, each.option)
        is_true &= _ordered(followed(draft, each.option).scenario()) == _ordered(others)
        presses.append(Press(is_true, is_held(after)))
    untried = None
    named = [option for option in hint.options if option.values]
    if before.outcome.ended_by_physics and named:
        untried = is_held(simulate(follow(scenario, named[0])))
    return Case(held, tuple(presses), untried)


def _ordered(scenario: Scenario) -> Scenario:
    """A scenario with its timed changes sorted, as by the page."""
    changes = sorted(scenario.changes, key=lambda change: (change.time, change.parameter))
    return replace(scenario, changes=tuple(changes))


def follow_all(seed: int, index: int) -> tuple[bool, dict[str, bool]]:
    """Whether the object of a random run is held, originally and with every change."""
    scenario = draw(seed, index)
    before = simulate(scenario)
    hint, after = describe_run(before).hint, {}
    for option in hint.trials:
        lone = type(hint)((option,))
        tried = try_hint(
            before, lone, budget=Budget(runs=1), simulate=lambda changed, _: simulate(changed)
        )
        if tried.count:
            after[name_of(option)] = is_held(simulate(follow(scenario, option)))
    return is_held(before), after


def name_of(option: Option) -> str:
    """Name of a change in the table, without its numbers."""
    keys = dict.fromkeys(re.sub(r"\.\d+\.", ".*.", key) for key in option.values)
    if LAW not in keys:
        return ", ".join(keys)
    settings = keys.keys() - {LAW}
    more = [key for key in keys if key.startswith(("estimates", "actuation"))]
    return ", ".join(["composite", *["set firmly"] * (settings > set(more)), *more])


def is_held(result: RunResult) -> bool:
    """Whether a complete run has no slip in its last half second."""
    trace = result.trace
    recent = trace.times > result.end_time - HOLD_WINDOW
    sticks = trace.phase[recent] == ContactPhase.STICK
    return result.outcome is Outcome.COMPLETED and bool(sticks.all())


def does_what_it_says(effect: str, before: RunResult, after: RunResult, goal: Goal) -> bool:
    """Whether the text about an effect agrees with the traces of both runs."""
    if not is_held(after):
        return False
    for part in effect.split(", "):
        pairs = ((re.fullmatch(pattern, part), value_of) for pattern, value_of in _EFFECTS.items())
        found, value_of = next((pair for pair in pairs if pair[0]), (None, slip_of))
        if found is None:
            agrees = part.startswith("held instead of ") and not is_held(before)
        else:
            told = zip(found.groups(), (after, before), strict=True)
            agrees = all(text is None or _near(text, value_of(run)) for text, run in told)
        if not agrees:
            return False
    gains = {
        Goal.HOLD: not is_held(before),
        Goal.LESS_SLIP: slip_of(after) < slip_of(before),
        Goal.NEARER: offset_of(after) < offset_of(before),
    }
    return gains[goal]


def _near(text: str, value: float) -> bool:
    """Whether a number in a text, with its unit, is that of a trace."""
    number, unit = ("0", "m") if text.startswith("less than") else text.split()
    return abs(float(number) * _UNITS[unit] - value) <= max(_ROUNDED * value, 1e-9)


def slip_of(result: RunResult) -> float:
    """Longest slip path of a fingertip, from the trace [m]."""
    trace = result.trace
    if trace.shape.space is SPATIAL:
        return float(trace.slip_path[-1].max())
    return float(np.abs(np.diff(trace.slip, axis=0)).sum(axis=0).max(initial=0.0))


def offset_of(result: RunResult) -> float:
    """Final distance of the object from its target, from the trace [m]."""
    ways = result.trace.shape.space.num_positions
    return float(np.linalg.norm(result.trace.tracking_error[-1, :ways]))


_EFFECTS: dict[str, Callable[[RunResult], float]] = {
    rf"slip {_LENGTH}(?: instead of {_LENGTH})?": slip_of,
    rf"{_LENGTH} off(?: instead of {_LENGTH})?": offset_of,
    r"normal force up to (\S+ N)(?: instead of (\S+ N))?": lambda result: max(
        result.metrics.peak_normal_force
    ),
}
"""Texts about a number after and before a hint, and the number."""


def draw(seed: int, index: int) -> Scenario:
    """A reproducible random run: random planar and spatial ones, usual planar and spatial ones."""
    return _DRAWS[index % len(_DRAWS)](f"hints {seed} {index}")


def _usual(presets: tuple[str, ...], seed: str) -> Scenario:
    """A hand of a preset, with a law and suitable settings, and random conditions."""
    rng = Random(seed)
    base = load_scenario(rng.choice(presets))
    base = with_law(base, rng.choice(tuple(CONTROL_LAWS)))
    values = dict(_object(base, rng)) | dict(_setting(base, rng))
    period = values.get("controller.control_period", base.controller.control_period)
    return with_values(base, values | (dict(_imperfect(rng)) if period else {}))


def _object(base: Scenario, rng: Random) -> Iterator[tuple[str, Any]]:
    mass = rng.uniform(0.3, 2.5)
    yield "object.mass", mass
    for name in (key.partition(".")[2] for key in base.space.inertias):
        head, _, axis = name.partition(".")
        inertia = getattr(base.object, head)
        before = inertia[int(axis)] if axis else inertia
        yield f"object.{name}", mass / base.object.mass * before
    for i in range(len(base.fingers)):
        yield f"fingers.{i}.friction", rng.uniform(0.12, 0.7)
    for k, estimate in enumerate(base.estimates):
        low = -np.inf if estimate.minimum is None else estimate.minimum
        high = np.inf if estimate.maximum is None else estimate.maximum
        initial = rng.uniform(0.5, 1.8) * estimate.initial
        yield f"estimates.{k}.initial", min(max(initial, low), high)


def _setting(base: Scenario, rng: Random) -> Iterator[tuple[str, Any]]:
    yield "title", ""
    yield "simulation.duration", 2.0
    yield "simulation.seed", rng.randrange(1000)
    yield "controller.velocity_gain", rng.choice((5.0, 10.0, 20.0))
    yield "controller.grip_force", rng.uniform(3.0, 40.0)
    yield "controller.grip_safety", rng.choice((1.0, 1.05, 1.2))
    if base.controller.control_period == 0.0 and rng.random() < 0.6:
        yield "controller.control_period", rng.choice((0.001, 0.002, 0.005))
    if CONTROL_LAWS[base.controller.kind].uses_friction:
        yield "controller.distribution", rng.choice(("exact", "hold"))


def _imperfect(rng: Random) -> Iterator[tuple[str, Any]]:
    """Delays, detection of slip, limits and noise, each in some runs."""
    if rng.random() < 0.4:
        yield "controller.latency", rng.uniform(0.001, 0.03)
    if rng.random() < 0.4:
        yield "sensing.true_phases", False
        yield "sensing.slip_delay", rng.uniform(0.001, 0.03)
    if rng.random() < 0.3:
        yield "actuation.torque_limit", rng.uniform(8.0, 40.0)
    if rng.random() < 0.3:
        yield "sensing.velocity_noise", rng.uniform(0.0003, 0.003)


_LONGER = {"simulation.duration": DURATION}
_DRAWS: tuple[Callable[[str], Scenario], ...] = (
    lambda seed: with_values(
        draw_scenario(draw_kind(Random(f"kind {seed}")), seed),
        {**_LONGER, "simulation.max_steps": MAX_STEPS},
    ),
    lambda seed: with_values(draw_hand_in_space(seed), _LONGER),
    partial(_usual, _PLANAR),
    partial(_usual, _SPATIAL),
)


def tabulate(cases: list[Case], seed: int) -> Table:
    """Results of applying the hints of random runs.

    Args:
        cases: The runs.
        seed: Seed of the draws.
    """
    presses = [press for case in cases for press in case.presses]
    held = [case for case in cases if case.held]
    lost = [case for case in cases if not case.held]
    firsts = [case.presses[0].holds for case in lost if case.presses]
    untried = [case.untried for case in lost if case.untried is not None]
    losses = sum(not press.holds for case in held for press in case.presses)
    rows = (
        ("runs drawn", str(len(cases))),
        ("of these held", str(len(held))),
        ("applied hints", str(len(presses))),
        ("have the stated effect", _share([press.is_true for press in presses])),
        ("held objects that a hint lost", str(losses)),
        ("not held before, held with the first hint, if there is one", _share(firsts)),
        ("not held before, held with the first hint, of all", format_share(len(firsts), len(lost))),
        ("not held before, nor with any tried hint, as reported", str(len(lost) - len(firsts))),
        ("ended early, held with the first hint without trials", _share(untried)),
    )
    note = (
        "Targets: at least 95 % have the stated effect, no held object lost, at least 70 % held "
        f"with the first hint (seed {seed})."
    )
    return Table("hints", ("", ""), rows, (note,), "verification.md")


def tabulate_options(found: list[tuple[bool, dict[str, bool]]]) -> Table:
    """Effect of every single change on lost objects, and on held ones.

    Args:
        found: Whether the object of each run was held, originally and with each change.
    """
    tried: dict[str, tuple[list[bool], list[bool]]] = {}
    for was_held, after in found:
        for name, holds in after.items():
            tried.setdefault(name, ([], []))[was_held].append(holds != was_held)

    def effect(name: str) -> tuple[float, int, str]:
        lost = tried[name][False]
        return -sum(lost) / max(len(lost), 1), -len(lost), name

    rows = tuple(
        (f"`{name}`", *(f"{sum(changed)} of {len(changed)}" for changed in tried[name]))
        for name in sorted(tried, key=effect)
    )
    heads = ("change", "lost objects that it holds", "held objects that it loses")
    note = f"Every change tried on {len(found)} other random runs, whether it helps or not."
    return Table("hints-options", heads, rows, (note,), "verification.md")


def _share(values: list[bool]) -> str:
    return format_share(sum(values), len(values)) if values else "–"
