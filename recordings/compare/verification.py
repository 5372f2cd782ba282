"""Verification of a recorded run by a new simulation of its scenario.

If the numerics have the same name, or one with known equal bits, every bit must agree on any
machine. Another version may round differently, and slip amplifies rounding errors, so that the
stated tolerance applies.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

from slipgrasp.core.run.claims import contradictions_of
from slipgrasp.core.run.provenance import Provenance, present_provenance
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.scenario.chosen_laws import custom_kind_in
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.compare.reproduction import (
    TIME_TOLERANCE,
    Mismatch,
    RunPair,
    find_bit_mismatches,
    find_mismatches,
)

_CUT_SHORT = (Outcome.STOPPED, Outcome.FAILED, Outcome.RECOVERED)
WALL_TIME = "wall_time"

Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Verification:
    """The result of a verification.

    Attributes:
        same: Whether the recording agrees with the new simulation and was not altered.
        bit_for_bit: Whether every bit had to agree; else the tolerance of
            `slipgrasp.recordings.compare.reproduction` applied.
        replayed: Whether recorded commands of a custom law were used instead of its code.
        whole: Whether the whole run was compared; one that was stopped early (stopped, limit of
            elapsed time, failed, recovered) is compared up to its recorded end.
        num_samples: Number of compared samples.
        end_time: Recorded simulation time [s].
        unaltered: Whether the hashes in the file agree with its content.
        mismatches: Differences, the earliest first.
        recorded: Provenance of the recorded run.
        present: Provenance of the new simulation.
    """

    same: bool
    bit_for_bit: bool
    replayed: bool
    whole: bool
    num_samples: int
    end_time: float
    unaltered: bool
    mismatches: tuple[Mismatch, ...]
    recorded: Provenance
    present: Provenance

    def to_mapping(self) -> dict[str, Any]:
        """The verification as plain values for JSON (the ``verify --json`` object)."""
        mapping = asdict(self)
        return {**mapping, "mismatches": [asdict(mismatch) for mismatch in self.mismatches]}


def verify(
    result: RunResult,
    *,
    unaltered: bool = True,
    with_law: bool = False,
    progress: Progress | None = None,
) -> Verification:
    """Simulates a recorded run again and compares.

    A custom law is not needed: the plant is simulated with its recorded commands.

    Args:
        result: The run.
        unaltered: Whether the hashes in its file agree with its content.
        with_law: Whether the code of a custom law is executed too.
        progress: Called with the completed fraction, 0 to 1.

    Raises:
        ScenarioError: If this version cannot simulate the scenario.
    """
    whole = not _is_cut_short(result)
    present = present_provenance(result.scenario.space)
    bit_for_bit = result.provenance.has_bits_of(present)
    replayed = custom_kind_in(result.scenario) is not None and not with_law
    simulation = Simulation.replaying(result) if replayed else Simulation(result.scenario)
    computed = _compute_again(result, simulation, progress, bit_for_bit=bit_for_bit)
    pair = RunPair(recorded=result, computed=computed, whole=whole)
    found = find_bit_mismatches(pair) if bit_for_bit else find_mismatches(pair)
    mismatches = (
        *_law_mismatch(result, computed),
        *(tuple(found) or tuple(_own_mismatches(result))),
    )
    return Verification(
        same=unaltered and not mismatches,
        bit_for_bit=bit_for_bit,
        replayed=replayed,
        whole=whole,
        num_samples=len(result.trace),
        end_time=result.end_time,
        unaltered=unaltered,
        mismatches=mismatches,
        recorded=result.provenance,
        present=replace(present, law=computed.provenance.law),
    )


def _law_mismatch(recorded: RunResult, computed: RunResult) -> Iterator[Mismatch]:
    """Reports a law with the recorded name but another version."""
    then, now = recorded.provenance.law, computed.provenance.law
    if then != now:
        said = [None if law is None else f"{law.name} {law.digest[:12]}" for law in (then, now)]
        yield Mismatch(what="law", time=None, recorded=said[0], computed=said[1])


def _own_mismatches(result: RunResult) -> Iterator[Mismatch]:
    """Statements in the recording that contradict its samples beyond rounding."""
    for found in contradictions_of(result):
        is_metric = found.what not in ("outcome", "phase_changes")
        what, name = ("metrics", f"{found.what} ") if is_metric else (found.what, "")
        recorded, computed = (f"{name}{value}" for value in (found.stated, found.computed))
        yield Mismatch(what=what, time=None, recorded=recorded, computed=computed)


def _is_cut_short(result: RunResult) -> bool:
    """Whether a cause outside the model ended the run, which will not recur."""
    reason = result.reason
    return result.outcome in _CUT_SHORT or (reason is not None and reason.code == WALL_TIME)


def _compute_again(
    recorded: RunResult, simulation: Simulation, progress: Progress | None, *, bit_for_bit: bool
) -> RunResult:
    """Simulates the run again, as far as the comparison needs."""
    wanted = len(recorded.trace) + (0 if _is_cut_short(recorded) else 1)
    until = recorded.end_time + TIME_TOLERANCE

    def goes_on() -> bool:
        # With different rounding the number of samples may differ, but not the duration.
        return simulation.num_rows < wanted if bit_for_bit else simulation.time <= until

    while not simulation.finished and goes_on():
        simulation.advance()
        if progress is not None:
            progress(min(1.0, simulation.num_rows / len(recorded.trace)))
    return simulation.result()
