"""Checks that apply to every run.

Based on its trace, on the same run with a finer output (for half of the runs) and, if a run ends as
inconsistent or separated, on an independent search for consistent phases.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import maximum_filter1d

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import run_to_end
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.loading import with_values
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase, Outcome, PhaseChange
from tests.references.instant import answers_at_end, is_sampled_at_end
from tests.references.open_contacts import OPEN

FINE_RATE = 10_000.0  # [Hz]
SAME_INSTANT = 1e-9  # [s]
GIVEN_BACK = 1e-9  # [J]
ROUNDING = 1e-15  # of the energy dissipated by friction
OUTSIDE_CONE = 1e-9  # of 1 N and the forces
LEDGER = 1e-6  # [J]
VELOCITY_JUMP = 1e-8  # of 1 m/s and the velocity; slips below 3e-9 m/s end at once
LEDGER_SHARE = 1e-9  # of the largest energy of the run
SAME_METRIC = 1e-9  # of 1 and the metric
TOLERANCES = 10.0  # of the steps, for their sum
FORCES = ("peak_normal_force", "minimum_friction_margin")
INSIDE_STEP = 1e-7  # accuracy of a force within a step, of 1 N and the largest force
STATED = re.compile(r"(?P<changes>\d+) phase changes within (?P<seconds>[-+.e\d]+) s")


class Check(NamedTuple):
    """One check.

    Attributes:
        text: Description of the violation.
        unit: Unit of the deviation; empty for a mere count.
    """

    text: str
    unit: str = ""


CHECKS = {
    "stall": Check("`chattering` without the stated phase changes"),
    "rate": Check("other phase changes, or another end, with 10 kHz output"),
    "friction": Check("friction does negative work of more than 1e-9 J", "J"),
    "cone": Check("a force outside its cone by more than 1e-9", "relative"),
    "ledger": Check("energy balance off by more than 1e-6 J and 1e-9 of the largest energy", "J"),
    "velocity": Check("velocities that differ at equal times by more than 1e-8", "m/s"),
    "inconsistent": Check("`inconsistent` although some phases or open contacts agree"),
    "separated": Check("`separated` at a jump although the contact need not or cannot open"),
    "metrics": Check("a metric that its trace exceeds, or other metrics with 10 kHz output"),
    "completed": Check("`completed` that does not reach its end, or a number not finite"),
}


class Judgement(NamedTuple):
    """Result of the checks of one run.

    Attributes:
        outcome: Outcome of the run.
        missed: Deviation of each failed check, in its unit, or 1.
    """

    outcome: str
    missed: Mapping[str, float]


class Pair(NamedTuple):
    """A run, perhaps simulated twice.

    Attributes:
        plain: The run.
        held: Torques at its end, ``(n, joints)`` [N m].
        fine: The same run with an output of 10 kHz, if any.
    """

    plain: RunResult
    held: np.ndarray
    fine: RunResult | None = None

    @property
    def runs(self) -> list[RunResult]:
        """The run, and the same with an output of 10 kHz, if any."""
        return [self.plain] if self.fine is None else [self.plain, self.fine]


class Judge(NamedTuple):
    """The checks of the runs of a population.

    Attributes:
        checks: The checks by name.
        measure: Deviation of each check by name, 0 if it is passed.
    """

    checks: Mapping[str, Check]
    measure: Callable[[Pair], Mapping[str, float]]

    def find_missed(self, pair: Pair) -> dict[str, float]:
        """Deviations of the failed checks, by name."""
        return {name: by for name, by in self.measure(pair).items() if by > 0.0}

    def judge(self, scenario: Scenario, *, twice: bool = True) -> Judgement:
        """Checks a run of a scenario.

        Args:
            scenario: Scenario to simulate.
            twice: Whether to simulate it again, with an output of 10 kHz.
        """
        plain, held = simulate_with_torques(scenario)
        finer = with_values(scenario, {"simulation.output_rate": FINE_RATE})
        fine = simulate_with_torques(finer)[0] if twice else None
        return Judgement(plain.outcome.value, self.find_missed(Pair(plain, held, fine)))


def common_missed(pair: Pair, same: float = VELOCITY_JUMP) -> dict[str, float]:
    """Deviations of the checks that need neither forces nor energies.

    Args:
        pair: The run.
        same: Allowed difference of equal velocities, relative to 1 m/s and the velocity.
    """
    (plain, _, fine), runs = pair, pair.runs
    return {
        "stall": max(map(stalled, runs)),
        "rate": 0.0 if fine is None or _same_course(plain, fine) else 1.0,
        "friction": max(given_back(run.trace) for run in runs),
        "velocity": max(velocity_jump(run.trace, same) for run in runs),
        "metrics": 0.0 if _same_metrics(plain, fine) and all(map(_metrics_hold, runs)) else 1.0,
        "completed": max(map(ends_wrongly, runs)),
    }


def simulate_with_torques(scenario: Scenario) -> tuple[RunResult, np.ndarray]:
    """The run, and the torques at its end ``(n, 2)``.

    The trace ends before a jump without consistent phases, hence with the torques before it.
    """
    simulation = Simulation(scenario)
    run_to_end(simulation, lambda _: None)
    held = np.array(simulation._run.discrete.torques[: len(scenario.fingers)])
    return simulation.result(), held


def stalled(run: RunResult) -> float:
    """1 if a run ends as chattering without the phase changes stated in its reason.

    Each contact counts once at an instant.
    """
    if run.outcome is not Outcome.CHATTERING or run.reason is None:
        return 0.0
    stated = STATED.search(run.reason.message)
    if stated is None:
        return 1.0
    start = run.end_time - float(stated["seconds"]) - SAME_INSTANT
    late = [change for change in run.phase_changes if change.time >= start]
    return 0.0 if _count_distinct(late) >= int(stated["changes"]) else 1.0


def _count_distinct(changes: Sequence[PhaseChange]) -> int:
    """Phase changes, without further ones of a contact at the same instant."""
    last: dict[int, float] = {}
    count = 0
    for change in changes:
        count += change.time - last.get(change.contact, -np.inf) > SAME_INSTANT
        last[change.contact] = change.time
    return count


def _same_course(run: RunResult, other: RunResult) -> bool:
    """Whether both have the same end after the same phase changes at the same times."""
    if run.outcome is not other.outcome or len(run.phase_changes) != len(other.phase_changes):
        return False
    times = [(run.end_time, other.end_time)]
    for a, b in zip(run.phase_changes, other.phase_changes, strict=True):
        if (a.contact, a.from_phase, a.to_phase) != (b.contact, b.from_phase, b.to_phase):
            return False
        times.append((a.time, b.time))
    return all(abs(a - b) <= SAME_INSTANT for a, b in times)


def given_back(trace: Trace) -> float:
    """Decrease of the energy dissipated by friction [J]; 0 if allowed."""
    lost = trace.dissipated_energy
    peak = np.maximum.accumulate(lost)
    returned = float(np.max(peak - lost))
    return returned if returned > max(GIVEN_BACK, ROUNDING * float(peak[-1])) else 0.0


def _outside_cone(run: RunResult) -> float:
    """The largest excess over the cone, or distance from it in slip, relative; 0 if allowed.

    The first row only assumes stick, and rows at the instant at which physics ends a run are
    excluded. A fast force is known only up to its change between adjacent floating-point times.
    """
    trace = run.trace
    rows = np.arange(len(trace)) > 0
    if run.outcome.ended_by_physics:
        rows &= trace.times < run.end_time
    across, bound = np.abs(trace.tangential_force), trace.friction_coefficient * trace.normal_force
    slips = trace.phase != ContactPhase.STICK
    excess = np.where(slips, np.abs(trace.tangential_force + trace.phase * bound), across - bound)
    excess -= _change_per_time_number(trace)
    relative = (excess / (1.0 + across + np.abs(trace.normal_force)))[rows]
    worst = float(relative.max(initial=0.0))
    return worst if worst > OUTSIDE_CONE else 0.0


def _change_per_time_number(trace: Trace) -> np.ndarray:
    """Change of each normal force between adjacent floating-point times, ``(rows, n)``.

    The fastest change next to the row: an event has two rows at its instant.
    """
    passed = np.diff(trace.times)[:, None]
    change = np.abs(np.diff(trace.normal_force, axis=0))
    rates = np.divide(change, passed, out=np.zeros_like(change), where=passed > 0.0)
    beside = np.concatenate([rates, np.zeros_like(trace.normal_force[:1])])
    return maximum_filter1d(beside, 4, axis=0) * np.spacing(trace.times)[:, None]


def ledger_error(trace: Trace, share: float = LEDGER_SHARE) -> float:
    """Error of the energy balance [J]; 0 if allowed, also relative to the largest energy."""
    energies = (
        trace.kinetic_energy,
        trace.potential_energy,
        trace.supplied_energy,
        trace.dissipated_energy,
    )
    greatest = max(float(np.abs(energy).max()) for energy in energies)
    missing = float(np.abs(trace.energy_residual).max())
    return missing if missing > max(LEDGER, share * greatest) else 0.0


def velocity_jump(trace: Trace, same: float | np.ndarray = VELOCITY_JUMP) -> float:
    """The largest difference of a velocity between rows at one time [m/s, rad/s]; 0 if allowed.

    Forces and accelerations jump at events; there are no impulses.
    """
    velocities = np.column_stack((trace.object_velocity, trace.slip_velocity))
    before, after = velocities[:-1], velocities[1:]
    excess = np.abs(after - before) - same * np.maximum(1.0, np.abs(before))
    jumps = np.where((excess > 0.0).T & (np.diff(trace.times) == 0.0), np.abs(after - before).T, 0)
    return float(jumps.max(initial=0.0))


def _metrics_hold(run: RunResult) -> bool:
    """Whether every metric agrees with the trace, or exceeds it if extremes are between rows."""
    trace, metrics = run.trace, run.metrics
    # A path and its slips are separate integrals.
    integrals = TOLERANCES * run.scenario.simulation.relative_tolerance
    slips = trace.phase != ContactPhase.STICK
    begins_twice = len(trace) > 1 and trace.times[1] == trace.times[0]
    margins = np.where(slips, np.inf, trace.friction_margin)[int(begins_twice) :]
    least = [np.inf if margin is None else margin for margin in metrics.minimum_friction_margin]
    late = trace.times[slips.any(axis=1)]
    last_slip = -np.inf if metrics.last_slip_time is None else metrics.last_slip_time
    return (
        _reaches(metrics.peak_normal_force, trace.normal_force.max(axis=0))
        and _reaches(margins.min(axis=0, initial=np.inf), least)
        and _reaches(metrics.slip_path, _slip_paths(trace), max(SAME_METRIC, integrals))
        and _reaches([last_slip], [late.max(initial=-np.inf)])
        and metrics.slipping_at_end == bool(slips[-1].any())
        and metrics.final_tracking_error == tuple(trace.tracking_error[-1].tolist())
        and metrics.phase_change_count == len(run.phase_changes)
    )


def _slip_paths(trace: Trace) -> np.ndarray:
    """Path length between the rows, ``(n,)`` [m]."""
    tangents = trace.shape.space.num_tangents
    ways = np.diff(trace.slip, axis=0).reshape(len(trace) - 1, trace.phase.shape[1], tangents)
    return np.linalg.norm(ways, axis=2).sum(axis=0)


def _reaches(upper: ArrayLike, lower: ArrayLike, share: float = SAME_METRIC) -> bool:
    """Whether all numbers reach their lower bounds, within a relative and absolute tolerance."""
    lower = np.asarray(lower, float)
    slack = share * (1.0 + np.abs(np.where(np.isfinite(lower), lower, 0.0)))
    return bool(np.all(np.asarray(upper, float) >= lower - slack))


def _same_metrics(run: RunResult, other: RunResult | None) -> bool:
    """Whether the metrics of two runs agree; forces within their accuracy in a step."""
    if other is None or not _same_course(run, other):
        return True
    mine, others = run.metrics.flattened(), other.metrics.flattened()
    if any((mine[name] is None) != (others[name] is None) for name in mine):
        return False
    names = [name for name in mine if mine[name] is not None]
    a, b = (np.array([metrics[name] for name in names], float) for metrics in (mine, others))
    of_force = np.array([name.startswith(FORCES) for name in names])
    largest = max(run.metrics.peak_normal_force)
    slack = np.where(of_force, INSIDE_STEP * (1.0 + largest), SAME_METRIC * (1.0 + np.abs(a)))
    return bool(np.all(np.abs(a - b) <= slack))


def ends_wrongly(run: RunResult) -> float:
    """1 if a completed run does not reach its end, has a reason, or any number is not finite."""
    reached = run.end_time == run.scenario.simulation.duration
    completed = run.outcome is Outcome.COMPLETED
    agree = completed == (run.reason is None) and (reached or not completed)
    return 0.0 if agree and np.all(np.isfinite(run.trace.to_rows())) else 1.0


def _need_not_open(run: RunResult, held: np.ndarray) -> float:
    """1 if a jump certainly ends a run as separated although the contact need not open, or cannot.

    While a phase is held, continuous control may have to exclude consistent phases.
    """
    if run.outcome is not Outcome.SEPARATED or run.reason is None or run.reason.value is not None:
        return 0.0
    contact = run.reason.contact
    if contact is None:
        return 1.0
    if is_sampled_at_end(run):
        if any(OPEN not in sure.phases for sure in answers_at_end(run, held, beyond_doubt=True)):
            return 1.0
    elif any(change.time == run.end_time for change in run.scenario.changes):
        # After a timed change, continuous control gives a torque that is in no row.
        return 0.0
    possible = answers_at_end(run, held, beyond_doubt=False)
    return float(all(answer.phases[contact] != OPEN for answer in possible))


def _measure(pair: Pair) -> dict[str, float]:
    run, held, _ = pair
    answers = answers_at_end(run, held, beyond_doubt=True)
    return common_missed(pair) | {
        "cone": max(map(_outside_cone, pair.runs)),
        "ledger": max(ledger_error(each.trace) for each in pair.runs),
        "inconsistent": float(run.outcome is Outcome.INCONSISTENT and any(answers)),
        "separated": _need_not_open(run, held),
    }


PLANAR = Judge(CHECKS, _measure)
