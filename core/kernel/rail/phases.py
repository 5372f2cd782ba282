"""Selection of phases of fingertip and rail that are consistent with the torque."""

from __future__ import annotations

from numba import types

from slipgrasp.core.kernel.compilation.compiler import compiled, compiled_apart
from slipgrasp.core.kernel.compilation.records import Record
from slipgrasp.core.kernel.loop.friction import present_friction
from slipgrasp.core.kernel.loop.guards import FORCE_BAND
from slipgrasp.core.kernel.loop.status import INCONSISTENT, PAINLEVE, RUNNING
from slipgrasp.core.kernel.planar.state import STATE
from slipgrasp.core.kernel.rail.flow import rail_plant
from slipgrasp.core.kernel.rail.guards import speed_at
from slipgrasp.core.kernel.rail.model import FINGER, MODEL, NUM_CONTACTS, RAIL_CONTACT
from slipgrasp.core.kernel.rail.state import DISCRETE, SPEED, WORKSPACE

REST_SPEED = 3e-9  # below which a contact may stick [m/s]
_UNCERTAIN = 1e-7  # acceleration with an uncertain sign at an onset of slip [m/s^2]
_ANY = 2  # a phase that is not yet known

_CONSISTENT, _WRONG, _IRREGULAR = range(3)


@compiled
def _check(model: Record, discrete: Record, state: Record, work: Record, onsets: int) -> int:
    """Whether the phases in ``discrete`` are consistent; the torque is that in ``work``."""
    rail_plant(model, discrete, work)
    if not work.determinant > 0.0:
        return _IRREGULAR
    for i in range(NUM_CONTACTS):
        phase, normal = discrete.phases[i], work.forces[i, 1]
        band = FORCE_BAND * (1.0 + abs(normal))
        if not normal >= -band:
            return _WRONG
        if phase == 0:
            if not abs(work.forces[i, 0]) <= present_friction(model, discrete, i) * normal + band:
                return _WRONG
        elif not abs(state.x[speed_at(i)]) > REST_SPEED:
            starts = phase * work.acceleration[1 - i]
            # At an onset the force has been on its cone, and the acceleration may still be 0.
            if not starts > (-_UNCERTAIN if (onsets >> i) & 1 else 0.0):
                return _WRONG
    return _CONSISTENT


@compiled
def _wanted(state: Record, i: int, known: int) -> int:
    """Phase of contact i if it is determined: known, or the sign of a velocity; else ``_ANY``."""
    if known != _ANY:
        return known
    speed = state.x[speed_at(i)]
    if abs(speed) > REST_SPEED:
        return 1 if speed > 0.0 else -1
    return _ANY


@compiled
def _search(
    model: Record,
    discrete: Record,
    state: Record,
    work: Record,
    first: int,
    second: int,
    onsets: int,
) -> int:
    """Finds consistent phases, with as few slipping contacts as possible.

    Args:
        model: Constants of the run.
        discrete: Phases; output.
        state: Current state.
        work: Torque of the law at this state.
        first: Phase of the fingertip if it is known, else ``_ANY``.
        second: Phase of the rail, likewise.
        onsets: Bits of the contacts whose slip begins.
    """
    verdict = _IRREGULAR
    for slips in range(3):
        for finger in range(-1, 2):
            for rail in range(-1, 2):
                if abs(finger) + abs(rail) != slips:
                    continue
                if first not in (_ANY, finger) or second not in (_ANY, rail):
                    continue
                discrete.phases[0], discrete.phases[1] = finger, rail
                found = _check(model, discrete, state, work, onsets)
                if found == _CONSISTENT:
                    return found
                if found == _WRONG:
                    verdict = _WRONG
    return verdict


@compiled_apart(types.int64, MODEL, DISCRETE, DISCRETE, STATE, WORKSPACE, types.int64)
def rail_select(
    model: Record, discrete: Record, old: Record, state: Record, work: Record, fired: int
) -> int:
    """Selects the phases; stops fingertip and object exactly where they stick.

    Args:
        model: Constants of the run.
        discrete: Phases; output.
        old: Phases before the jump, with the forces of this state in ``work``.
        state: Current state; velocities that count as rest are set to 0 in stick.
        work: The closed loop, evaluated at this state.
        fired: Bits of the contacts whose phase ends here; -1 if the force may have jumped.

    Returns:
        RUNNING, or the reason why no phases are consistent.
    """
    verdict = _WRONG
    if fired >= 0:
        first, onset_1 = _after(old, state, work, 0, fired)
        second, onset_2 = _after(old, state, work, 1, fired)
        verdict = _search(model, discrete, state, work, first, second, onset_1 | onset_2)
    if verdict != _CONSISTENT:
        first, second = _wanted(state, 0, _ANY), _wanted(state, 1, _ANY)
        verdict = _search(model, discrete, state, work, first, second, 0)
    if verdict == _CONSISTENT:
        for i in range(NUM_CONTACTS):
            if abs(state.x[speed_at(i)]) <= REST_SPEED and discrete.phases[i] == 0:
                state.x[speed_at(i)] = 0.0
        return RUNNING
    return PAINLEVE if verdict == _IRREGULAR else INCONSISTENT


@compiled
def _after(old: Record, state: Record, work: Record, i: int, fired: int) -> tuple[int, int]:
    """Phase of contact i after an event if it is known, and its bit if its slip begins."""
    if (fired >> i) & 1 == 0:
        return old.phases[i], 0
    if old.phases[i] != 0:
        return _wanted(state, i, _ANY), 0
    # Friction on the object has the direction of the fingertip's motion, -t s', and opposes x'.
    return (-1 if work.forces[i, 0] > 0.0 else 1), 1 << i


@compiled
def opened_contact(model: Record, state: Record, work: Record) -> int:
    """Contact that opens if no phases are consistent; -1 if none does.

    The fingertip comes off if without contact force it accelerates away from the object; the
    object lifts off if it accelerates upwards with a sticking fingertip and without a rail.
    """
    gx, gy = work.tip_force[0] - work.bias[0], work.tip_force[1] - work.bias[1]
    xx, xy, yy = work.inertia[0], work.inertia[1], work.inertia[2]
    determinant = xx * yy - xy * xy
    ax, ay = (yy * gx - xy * gy) / determinant, (xx * gy - xy * gx) / determinant
    speed, brakes = state.x[SPEED], model.truth.friction[RAIL_CONTACT] * model.hand.gravity
    if abs(speed) > REST_SPEED:
        ax += brakes if speed > 0.0 else -brakes
    if ax * model.cosine - ay * model.sine < 0.0:
        return FINGER
    mass = model.truth.object_inertia[0]
    lift = (xx + mass) * (gy - mass * model.hand.gravity) - xy * gx
    return RAIL_CONTACT if lift > 0.0 else -1
