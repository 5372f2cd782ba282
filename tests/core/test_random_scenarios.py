"""What must hold in every run: properties of random scenarios and of the longer `RUNS`."""

import json
from collections import Counter
from collections.abc import Callable
from functools import cache
from itertools import pairwise
from typing import get_args, get_type_hints

import numpy as np
import pytest

from slipgrasp.core.kernel.planar.guards import VELOCITY_BAND
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import ControllerParameters, TrajectoryParameters
from slipgrasp.core.scenario.loading import scenario_to_toml
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase, Outcome
from tests.core.drawn_pairs import draw_in_pairs
from tests.core.drawn_scenarios import KINDS, draw_scenario
from tests.core.test_invariants import RUNS
from tests.core.test_invariants import run as run_by_name
from tests.references.closed_loop import ClosedLoop

pytestmark = pytest.mark.slow

EACH = 13
SLOW = 1e-7  # [m/s]
PAIRED = 40  # of `tests.core.drawn_pairs`
COMMON = (
    *("long", "slipped", "sampled", "continuous", "changed", "unknown"),
    *("pushed", "patched", "polygon", "static"),
)
RARE = (
    *("completed", "separated", "stopped", "squeezed by many"),
    *("late", "noisy", "blind", "weak"),
)
LAWS = get_args(get_type_hints(ControllerParameters)["kind"])
MOTIONS = get_args(get_type_hints(TrajectoryParameters)["kind"])
ENDS = {*Outcome} - {Outcome.STOPPED, Outcome.FAILED, Outcome.RECOVERED}


@cache
def runs_of(kind: int | str) -> tuple[RunResult, ...]:
    """Random runs of a kind or with levels in pairs, or a longer run by its name."""
    if isinstance(kind, int):
        drawn = (draw_scenario(KINDS[kind], number) for number in range(EACH))
        return tuple(map(simulate, drawn))
    if kind in RUNS:
        return (run_by_name(kind),)
    pairs = (draw_in_pairs("in pairs", number, False) for number in range(PAIRED))
    return tuple(simulate(each.scenario) for each in pairs)


def of_every_kind(check: Callable[[RunResult], None]) -> Callable[[int | str], None]:
    """Checks the runs of every kind, and prints the scenario of one that fails."""

    @pytest.mark.parametrize("kind", [*range(len(KINDS)), "in pairs", *RUNS])
    def test(kind: int | str) -> None:
        for run in runs_of(kind):
            try:
                check(run)
            except AssertionError:
                print(scenario_to_toml(run.scenario))
                raise

    return test


def force_size(trace: Trace) -> np.ndarray:
    """What errors of forces are measured by, ``(rows, n)`` [N]."""
    return 1.0 + np.abs(trace.normal_force) + np.abs(trace.tangential_force)


def goes_on(result: RunResult) -> tuple[Trace, np.ndarray]:
    """The trace and its rows in which the run goes on, ``(rows,)``.

    The first row only assumes stick. Rows at the instant at which physics ends the run
    show what cannot go on: a contact that pulls, or the phases before a choice that fails.
    """
    rows = np.arange(len(result.trace)) > 0
    if result.outcome.ended_by_physics:
        rows &= result.trace.times < result.end_time
    return result.trace, rows


def speeds_along(trace: Trace) -> tuple[np.ndarray, np.ndarray]:
    """Slip velocities along their phases, and which belong to slips faster than ``SLOW``.

    A slower slip may begin and end within one step. Its end is then located where the velocity has
    the level of a guard that begins in its band, not at zero.
    """
    speeds, is_fast = trace.slip_velocity * trace.phase, np.zeros(trace.phase.shape, bool)
    for contact, phases in enumerate(trace.phase.T):
        edges = [0, *np.flatnonzero(np.diff(phases)) + 1, len(phases)]
        for first, last in pairwise(edges):
            is_fast[first:last, contact] = speeds[first:last, contact].max() > SLOW
    return speeds, is_fast


def sorts_of(result: RunResult) -> set[str]:
    """What the scenario and its run are examples of."""
    scenario = result.scenario
    law, sensing, n = scenario.controller, scenario.sensing, len(scenario.fingers)
    is_true = {
        "sampled": law.control_period > 0.0,
        "continuous": law.control_period == 0.0,
        "long": result.end_time > 0.1,
        "slipped": bool(np.any(result.trace.phase[1:])),
        "stopped": any(
            c.to_phase is ContactPhase.STICK and c.time > 0.0 for c in result.phase_changes
        ),
        "changed": bool(scenario.changes),
        "unknown": bool(scenario.estimates),
        "pushed": bool(scenario.pulses),
        "patched": bool(scenario.patches),
        "polygon": bool(scenario.object.corners),
        "static": any(f.static_friction is not None for f in scenario.fingers),
        "squeezed by many": n > 2 and law.grasp_force == "minimum",
        "late": law.latency > 0.0,
        "noisy": sensing.position_noise > 0.0 or sensing.velocity_noise > 0.0,
        "blind": not (sensing.true_phases and sensing.true_accelerations),
        "weak": scenario.actuation.torque_limit is not None,
    }
    named = {result.outcome.value, law.kind, scenario.trajectory.kind}
    return named | {sort for sort, is_one in is_true.items() if is_one}


@of_every_kind
def test_every_run_ends_with_an_outcome_and_finite_numbers(result: RunResult) -> None:
    assert result.outcome in ENDS
    completed = result.outcome is Outcome.COMPLETED
    assert completed == (result.reason is None)
    assert completed == (result.end_time == result.scenario.simulation.duration)
    assert len(result.trace) >= 1
    assert np.all(np.isfinite(result.trace.to_rows()))
    assert np.all(np.diff(result.trace.times) >= 0.0)
    json.dumps(result.summary(), allow_nan=False)


@of_every_kind
def test_friction_never_gives_power(result: RunResult) -> None:
    trace, rows = goes_on(result)
    # F_x times the slip velocity is the power that friction adds; rounding of F_x.
    power = trace.tangential_force * trace.slip_velocity
    limit = 1e-9 * force_size(trace) * np.abs(trace.slip_velocity)
    _, is_fast = speeds_along(trace)
    assert np.all((power <= limit)[rows] | ~is_fast[rows])
    lost = trace.dissipated_energy
    assert np.all(np.diff(lost) >= -1e-12 * max(1.0, float(lost.max())))


@of_every_kind
def test_no_force_is_outside_its_cone_and_no_contact_pulls(result: RunResult) -> None:
    trace, rows = goes_on(result)
    size = force_size(trace)
    bound = trace.friction_coefficient * trace.normal_force
    # What a force may gain, relative to its size, by the time an event is located (1e-10 s).
    assert np.all((np.abs(trace.tangential_force) <= bound + 1e-6 * size)[rows])
    assert np.all((trace.normal_force > -1e-9 * size)[rows])
    slipping = (trace.phase != ContactPhase.STICK) & rows[:, None]
    off = np.abs(trace.tangential_force + trace.phase * bound)
    assert np.all((off <= 1e-9 * size)[slipping])


@of_every_kind
def test_a_sticking_contact_does_not_creep_at_all(result: RunResult) -> None:
    trace = result.trace
    stick = trace.phase == ContactPhase.STICK
    assert np.all(trace.slip_velocity[stick] == 0.0)
    assert np.all(trace.slip_acceleration[stick] == 0.0)
    throughout = stick[1:] & stick[:-1]
    assert np.all(np.diff(trace.slip, axis=0)[throughout] == 0.0)


@of_every_kind
def test_a_slipping_contact_moves_in_the_direction_of_its_phase(result: RunResult) -> None:
    speeds, is_fast = speeds_along(result.trace)
    # At a located end of slip the velocity is zero to rounding.
    assert np.all(speeds[is_fast] >= -1e-12)
    assert np.all(speeds >= -2.0 * VELOCITY_BAND - 1e-12)  # the lowest level of a guard


@of_every_kind
def test_fingertips_stay_on_their_faces(result: RunResult) -> None:
    """Forward kinematics of the joints against pose and slip, in every stored row."""
    trace, hand = result.trace, ClosedLoop.from_scenario(result.scenario).hand
    slides = [finger.kind == "slides" for finger in result.scenario.fingers]
    for pose, slip, joints in zip(trace.object_pose, trace.slip, trace.joint_position, strict=True):
        fingers = zip(hand.fingers, slides, joints.reshape(-1, 2), strict=True)
        tips = np.array([f.base + q if slide else f.tip(q) for f, slide, q in fingers])
        assert np.abs(tips - hand.tip_positions(pose, slip)).max() <= 1e-9


@of_every_kind
def test_energy_is_supplied_stored_or_lost_to_friction(result: RunResult) -> None:
    trace = result.trace
    scale = max(1.0, float(np.abs(trace.kinetic_energy).max()))
    assert np.abs(trace.energy_residual).max() <= 1e-6 * scale


def test_random_scenarios_are_of_every_sort() -> None:
    """The properties above are not empty: hands hold, drop and slip, for long enough."""
    seen: Counter[str] = Counter()
    for kind in range(len(KINDS)):
        for run in runs_of(kind):
            seen.update(sorts_of(run))
    drawn = EACH * len(KINDS)
    assert drawn >= 150
    assert all(seen[sort] >= 0.2 * drawn for sort in COMMON), seen
    assert all(seen[sort] >= 0.05 * drawn for sort in (*RARE, *LAWS, *MOTIONS)), seen
