"""The last instant of a run: which phases, or open contacts, would have agreed there."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.run.result import RunResult
from tests.references.changes import scenario_at
from tests.references.hand import State
from tests.references.open_contacts import OPEN, REST_SPEED, Answer, Instant
from tests.references.world import World

Array = NDArray[np.float64]

# Laws whose torque depends on the believed phase, as the references know them.
PHASE_LAWS = ("theorem-3", "theorem-4", "certainty-equivalence")


def answers_at_end(run: RunResult, held: Array, *, beyond_doubt: bool = True) -> Iterator[Answer]:
    """Combinations that agree where a run ends.

    Under sampled control the torque is held. With continuous control every combination is tried
    under the torque that the law gives for it (a contact that opens is believed to do what a
    closed one may), under the belief before, and under that in the phases before: one of the two
    the controller may hold.

    Args:
        run: The run.
        held: The torques that act at its end, ``(n, 2)`` [N m].
        beyond_doubt: Whether those are left out that agree only just, or only nearly.
    """
    last, t = run.trace[-1:], run.end_time
    scenario = scenario_at(run.scenario, t)
    state = State(last.object_pose[0], last.object_velocity[0], last.slip[0], last.slip_velocity[0])
    world = World.from_scenario(scenario)
    z = np.concatenate((state.pose, state.velocity, state.slip, state.slip_velocity))
    loop = world.loop(t, world.sides(t, z))
    instant, law = Instant(loop, state), scenario.controller
    if law.control_period > 0.0 or law.kind not in PHASE_LAWS:
        torques = held.ravel() if law.control_period > 0.0 else last.joint_torque[0]
        yield from instant.answers(torques, beyond_doubt=beyond_doubt)
        return
    desired = loop.trajectory.desired(t, np.nextafter(t, np.inf))
    may_hold = (_phases(last.believed_phase[0]), _phases(last.phase[0]))
    for belief in dict.fromkeys((*may_hold, *_candidates(state))):
        torques = loop.evaluate(state, belief, last.estimates[0], desired).torques
        for answer in instant.answers(torques, beyond_doubt=beyond_doubt):
            if belief in may_hold or _recognised(answer, belief):
                yield answer


def is_sampled_at_end(run: RunResult) -> bool:
    """Whether torques are held where a run ends."""
    return scenario_at(run.scenario, run.end_time).controller.control_period > 0.0


def _candidates(state: State) -> Iterator[tuple[int, ...]]:
    """Phases of the contacts if none opens: any of those at rest, the others as they move."""
    choices = [
        (0, 1, -1) if abs(speed) < REST_SPEED else (int(np.sign(speed)),)
        for speed in state.slip_velocity
    ]
    return product(*choices)


def _phases(row: Array) -> tuple[int, ...]:
    return tuple(int(phase) for phase in row)


def _recognised(answer: Answer, belief: tuple[int, ...]) -> bool:
    """Whether the controller believes what the plant does, where contacts stay closed."""
    return all(own in (OPEN, believed) for own, believed in zip(answer.phases, belief, strict=True))
