"""Selection of phases consistent with the applied torque (docs/model.md, Phase selection)."""

from __future__ import annotations

import numpy as np
from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Integers, Record
from slipgrasp.core.kernel.loop.friction import has_static_excess
from slipgrasp.core.kernel.loop.guards import FORCE_BAND
from slipgrasp.core.kernel.planar.flow import flow
from slipgrasp.core.kernel.planar.guards import friction_margin
from slipgrasp.core.kernel.planar.inertia import solve
from slipgrasp.core.kernel.planar.model import MODEL
from slipgrasp.core.kernel.planar.state import (
    STATE,
    count_coordinates,
    slip_coordinate,
    slip_velocity_at,
)
from slipgrasp.core.kernel.planar.workspace import DISCRETE, WORKSPACE

SELECTED, AMBIGUOUS, NONE_CONSISTENT, NONE_REGULAR, NONE_COMMANDED = range(5)
_CONSISTENT, _WRONG, _PULLS, _IRREGULAR, _WITHOUT_TORQUE = range(5)

REST_SPEED = 3e-9
PROBE_TIME = 1e-6
MARGIN_SLOPE = 1e-5


# Intermediate values of a selection.
SELECTION_ROOM = np.dtype(
    [
        ("previous", np.int64, (MAX_FINGERS,)),
        ("beliefs", np.int64, (MAX_FINGERS,)),  # before the selection
        ("best", np.int64, (MAX_FINGERS,)),
        ("free", np.int64, (MAX_FINGERS,)),  # 1 if the slip velocity is zero
        ("loose", np.int64, (MAX_FINGERS,)),  # 1 if static friction is exceeded
        ("open", np.int64, (MAX_FINGERS,)),  # 1 if the contact opens in the candidate
        ("gaps", np.float64, (MAX_FINGERS,)),  # its gap acceleration [m/s^2]
        ("derivative", STATE),
        ("selected", np.int64),  # 1 if derivative and workspace belong to the selected phases
        ("probe", STATE),
        ("probed", np.int64),  # 1 if the derivative belongs to the probe
        ("doubtful", np.int64, (MAX_FINGERS,)),  # 1 if the value is inside its band
        ("values", np.float64, (MAX_FINGERS,)),  # distances inside the candidate of those [N]
    ],
    align=True,
)


@compiled
def distance_inside(model: Record, discrete: Record, work: Record, i: int) -> tuple[float, float]:
    """Distance of contact i inside its candidate phase, and the band in which it is uncertain [N].

    In slip, the distance is the additional friction force at which the contact would stick, so
    that stick and slip leave their bands together.
    """
    band = FORCE_BAND * (1.0 + work.forces[i, 1])
    if discrete.phases[i] == 0:
        return friction_margin(model, discrete, work, i), band
    n, unit = model.num_fingers, work.column
    for k in range(count_coordinates(n)):
        unit[k] = 1.0 if k == slip_coordinate(i) else 0.0
    solve(work.factors, n, unit)
    return discrete.phases[i] * work.acceleration[slip_coordinate(i)] / abs(
        unit[slip_coordinate(i)]
    ), band


@compiled
def _moves_inward(
    model: Record,
    discrete: Record,
    t: float,
    state: Record,
    work: Record,
    room: Record,
) -> bool:
    """Decides doubtful contacts by the time derivative of the distance along the candidate's flow.

    The distance must not decrease in stick, and must increase in slip.
    """
    room.probed = 1
    for j in range(model.num_states):
        room.probe.x[j] = state.x[j] + PROBE_TIME * room.derivative.x[j]
    flow(model, discrete, t + PROBE_TIME, room.probe, room.derivative, work)
    for i in range(model.num_fingers):
        if room.doubtful[i] == 0:
            continue
        value, _ = distance_inside(model, discrete, work, i)
        slope = (value - room.values[i]) / PROBE_TIME
        least = MARGIN_SLOPE * (1.0 + work.forces[i, 1])
        if slope < -least or (discrete.phases[i] != 0 and not slope > least):
            return False
    return True


@compiled_apart(types.int64, MODEL, DISCRETE, types.float64, STATE, WORKSPACE, SELECTION_ROOM)
def _judge(
    model: Record, discrete: Record, t: float, state: Record, work: Record, room: Record
) -> int:
    """Checks the candidate in ``discrete``; returns _CONSISTENT or the reason why not."""
    n = model.num_fingers
    flow(model, discrete, t, state, room.derivative, work)
    if not work.factors.determinant > 0.0:
        return _IRREGULAR
    if np.isnan(work.tip_forces[0, 0]):
        return _WITHOUT_TORQUE
    for i in range(n):
        if not work.forces[i, 1] > 0.0:
            return _PULLS
    doubts, room.probed = False, 0
    for i in range(n):
        room.doubtful[i] = 0
        if room.free[i] == 0:
            continue
        value, band = distance_inside(model, discrete, work, i)
        if value < -band:
            return _WRONG
        if value <= band:
            room.doubtful[i] = 1
            room.values[i] = value
            doubts = True
    if doubts and not _moves_inward(model, discrete, t, state, work, room):
        return _WRONG
    return _CONSISTENT


@compiled
def _set_candidate(model: Record, discrete: Record, room: Record, code: int, instant: int) -> int:
    """Sets candidate number ``code`` (0 = all free contacts stick) and returns its rank."""
    score = 0
    n = model.num_fingers
    for i in range(n):
        if room.free[i] == 0:
            continue
        digit = code % 3
        code //= 3
        discrete.phases[i] = 0 if digit == 0 else (1 if digit == 1 else -1)
        if digit == 0:
            score += n + 1 if room.loose[i] == 0 else -n - 1
        elif discrete.phases[i] == room.previous[i]:
            score += 1
    if instant == 1:
        _set_phases(discrete, discrete.phases, discrete.phases, n)
    return score


@compiled
def _differ_by_static_excess(model: Record, phases: Integers, others: Integers) -> bool:
    """True if phases differ only in stick or slip, and only at contacts with static excess."""
    for i in range(model.num_fingers):
        if phases[i] != others[i] and (
            phases[i] * others[i] != 0 or not has_static_excess(model, i)
        ):
            return False
    return True


@compiled
def _find_loose(
    model: Record, discrete: Record, t: float, state: Record, work: Record, room: Record
) -> None:
    """Marks the contacts whose static friction is exceeded if all free contacts stick."""
    flow(model, discrete, t, state, room.derivative, work)
    for i in range(model.num_fingers):
        value, band = distance_inside(model, discrete, work, i)
        held = room.free[i] == 0 or value > band or not has_static_excess(model, i)
        room.loose[i] = 0 if held else 1


@compiled
def _set_phases(discrete: Record, phases: Integers, beliefs: Integers, n: int) -> None:
    for i in range(n):
        discrete.phases[i] = phases[i]
        discrete.beliefs[i] = beliefs[i]


@compiled_apart(
    types.int64,
    MODEL,
    DISCRETE,
    types.float64,
    STATE,
    types.int64,
    types.int64,
    WORKSPACE,
    SELECTION_ROOM,
)
def select_phases(
    model: Record,
    discrete: Record,
    t: float,
    state: Record,
    instant: int,
    exhaustive: int,
    work: Record,
    room: Record,
) -> int:
    """Finds the consistent phases and sets ``discrete.phases`` to them.

    Among several candidates, those with more sticking contacts are preferred, then those with the
    previous slip directions. A contact with more friction in stick than in slip causes no
    ambiguity: it slips if its static friction is exceeded while all stick, and sticks otherwise.

    Args:
        model: Constants of the run.
        discrete: Previous phases; the true phases are overwritten, also the estimated ones if
            ``instant``.
        t: Time [s].
        state: State; slip velocities of contacts at rest count as zero.
        instant: 1 if the controller recognises each candidate phase at once, so that each is
            tested under the torque for it; 0 to test all under the current torque.
        exhaustive: 1 to test all candidates, to detect ambiguity; 0 to stop if all free contacts
            may stick.
        work: Workspace; contains the last candidate tested on return.
        room: Intermediate values.

    Returns:
        SELECTED, AMBIGUOUS, or the reason why there is none; the phases are then unchanged.
    """
    n = model.num_fingers
    combinations, excess, room.selected = 1, False, 0
    for i in range(n):
        room.previous[i] = discrete.phases[i]
        room.beliefs[i] = discrete.beliefs[i]
        room.free[i] = 1 if abs(state.x[slip_velocity_at(n, i)]) < REST_SPEED else 0
        room.loose[i] = 0
        excess = excess or has_static_excess(model, i)
        combinations *= 3 if room.free[i] == 1 else 1
    found, ambiguous, best_score, verdict_found = 0, False, 0, NONE_CONSISTENT
    for code in range(combinations):
        score = _set_candidate(model, discrete, room, code, instant)
        verdict = _judge(model, discrete, t, state, work, room)
        if verdict == _CONSISTENT:
            found += 1
            if found > 1 and not _differ_by_static_excess(model, discrete.phases, room.best):
                ambiguous = True
            if found == 1 or score > best_score:
                best_score = score
                for i in range(n):
                    room.best[i] = discrete.phases[i]
            if code == 0 and exhaustive == 0:
                room.selected = 1 - room.probed
                break
        elif verdict == _IRREGULAR:
            verdict_found = NONE_REGULAR
        elif verdict == _WITHOUT_TORQUE:
            verdict_found = NONE_COMMANDED
        elif verdict == _WRONG and code == 0 and excess:
            _find_loose(model, discrete, t, state, work, room)
    if found == 0:
        _set_phases(discrete, room.previous, room.beliefs, n)
        return verdict_found
    _set_phases(discrete, room.best, room.best if instant == 1 else room.beliefs, n)
    return AMBIGUOUS if ambiguous else SELECTED


@compiled_apart(types.int64, MODEL, DISCRETE, types.float64, STATE, WORKSPACE, SELECTION_ROOM)
def is_consistent(
    model: Record, discrete: Record, t: float, state: Record, work: Record, room: Record
) -> int:
    """1 if the true phases are consistent under the torque for the estimated phases, else 0."""
    n = model.num_fingers
    for i in range(n):
        room.free[i] = 1 if abs(state.x[slip_velocity_at(n, i)]) < REST_SPEED else 0
    return 1 if _judge(model, discrete, t, state, work, room) == _CONSISTENT else 0
