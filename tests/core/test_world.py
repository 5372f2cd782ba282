"""Pulses, static friction, patches and poured mass: motions whose exact solution is known.

With the true friction, the true links and a wrong object mass, both tips of the sample hand
slide exactly on the cone that the controller expects: the fingers stay where they are, and
the object moves like the block of the textbook under its weight, the weight that is believed
and the pulses. Normal forces are then the believed weight over twice the friction.
"""

from itertools import permutations

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import ContactPhase, Outcome
from tests.core.test_closed_forms import change
from tests.core.test_hybrid_events import told
from tests.references.closed_loop import ClosedLoop
from tests.references.hand import State

GRAVITY = 9.81
CASE_1 = load_scenario("paper-case-1")
CASE_2 = load_scenario("paper-case-2")

# No feedback and no adaptation: K_v is as small as the validation lets it be.
OPEN_LOOP = {
    "controller.position_gain": 0.0,
    "controller.velocity_gain": 1e-12,
    "controller.lyapunov_weight": 0.0,
    "trajectory.acceleration": [0.0, 0.0, 0.0],
    "simulation.duration": 0.3,
    **{f"estimates.{i}.initial": 1.0 for i in range(5)},
}
CONTROL_PERIODS = pytest.mark.parametrize("period", [0.0, 0.001])


def case(*parts, period=0.0):
    values = {"controller.control_period": period}
    for part in parts:
        values |= part
    return with_values(CASE_1, {**OPEN_LOOP, **values})


def push(index, t, duration, lift):
    """A pulse straight up, or down where it is negative."""
    key = f"pulses.{index}"
    force = [0.0, float(lift)]
    return {f"{key}.time": t, f"{key}.duration": duration, f"{key}.force": force}


def patch(index, face, start, end, factor, **times):
    """A patch between two distances from the middle of its face, along its tangent [m]."""
    values = {"face": face, "centre": 0.5 * (start + end), "half_length": 0.5 * (end - start)}
    values |= {"friction_factor": factor, **times}
    return {f"patches.{index}.{name}": value for name, value in values.items()}


def crossings(trace, contact):
    """Rows just before and just after each change of the friction coefficient."""
    before = np.flatnonzero(np.diff(trace.friction_coefficient[:, contact]) != 0.0)
    np.testing.assert_array_equal(trace.times[before], trace.times[before + 1])
    return [(int(row), int(row) + 1) for row in before]


@CONTROL_PERIODS
def test_two_pulses_set_the_object_sliding_and_stop_it_at_the_exact_place(period):
    """Down with 20 N for 20 ms, then up with 10 N until it stands still again: 40 ms."""
    down, up = push(0, 0.05, 0.02, -20.0), push(1, 0.1, 0.15, 10.0)
    result = simulate(case(down, up, period=period))
    trace = result.trace
    assert told(result)[:4] == [
        (0, ContactPhase.SLIP_FORWARD),
        (1, ContactPhase.SLIP_BACKWARD),
        (0, ContactPhase.STICK),
        (1, ContactPhase.STICK),
    ]
    assert [c.time for c in result.phase_changes[:2]] == [0.05, 0.05]
    stop = result.phase_changes[3].time
    # Until a tick tells it, sampled control holds the torque of the phase before.
    tolerance = 1e-9 if period == 0.0 else 1e-3
    assert stop == pytest.approx(0.1 + 0.04, abs=tolerance)
    at = np.flatnonzero(trace.times == stop)[0]
    way = 0.5 * 20.0 * 0.02**2 + 0.4 * (0.1 - 0.07) + 0.5 * 0.4 * 0.04
    np.testing.assert_allclose(np.abs(trace.slip[at]), way, rtol=0.0, atol=tolerance)
    np.testing.assert_array_equal(
        trace.external_wrench[:, 1],
        np.select([_within(trace, 0.05, 0.07), _within(trace, 0.1, 0.25)], [-20.0, 10.0]),
    )
    np.testing.assert_allclose(trace.energy_residual, 0.0, atol=1e-9)


def _within(trace, start, end):
    """Rows from the second at ``start`` to the first at ``end``."""
    first = np.searchsorted(trace.times, start) + 1
    last = np.searchsorted(trace.times, end)
    rows = np.arange(len(trace))
    return (rows >= first) & (rows <= last)


def test_pulses_that_overlap_add_up_and_opposite_ones_are_none():
    """Where both act the row says the sum, and motion is as if nothing had pushed."""
    both = push(0, 0.05, 0.1, -30.0) | push(1, 0.05, 0.1, 30.0)
    result = simulate(case(both))
    assert result.phase_changes == ()
    assert np.all(result.trace.external_wrench == 0.0)
    twice = simulate(case(push(0, 0.05, 0.1, -10.0) | push(1, 0.1, 0.1, -10.0))).trace
    middle = (twice.times > 0.1) & (twice.times < 0.15)
    assert np.all(twice.external_wrench[middle, 1] == -20.0)
    np.testing.assert_allclose(twice.object_acceleration[middle, 1], -20.0, atol=1e-8)


def test_moment_of_a_pulse_turns_the_object_the_way_the_reference_says():
    turn = {**push(0, 0.0, 0.1, 0.0), "pulses.0.moment": 0.3}
    trace = simulate(case(turn, {"controller.grip_safety": 3.0})).trace
    loop = ClosedLoop.from_scenario(case(turn))
    start = State(np.array(CASE_1.trajectory.start), np.zeros(3), np.zeros(2), np.zeros(2))
    kin = loop.hand.kinematics(start)
    torques = trace.joint_torque[1]
    motion = loop.hand.solve_all_unknowns(kin, loop.truth, (0, 0), torques, [0.0, 0.0, 0.3])
    np.testing.assert_allclose(trace.object_acceleration[1], motion.acceleration[:3], atol=1e-9)
    assert trace.object_acceleration[1, 2] > 0.1


# The squeeze leaves 1.1 of the friction that is needed; static friction adds to that.
STATIC = {
    "controller.grip_safety": 1.1,
    "fingers.0.static_friction": 0.3,
    "fingers.1.static_friction": 0.3,
}


def largest_push():
    """The force down at which both contacts reach mu_s F_n: in stick all is linear in it."""
    scenario = case(STATIC)
    loop = ClosedLoop.from_scenario(scenario)
    start = State(np.array(CASE_1.trajectory.start), np.zeros(3), np.zeros(2), np.zeros(2))
    at_rest = loop.evaluate(start, (0, 0), loop.initial_estimates, loop.trajectory.desired(0.0))

    def margin(force):
        motion = loop.hand.solve_all_unknowns(
            at_rest.kin, loop.truth, (0, 0), at_rest.torques, [0.0, -force, 0.0]
        )
        return 0.3 * motion.forces[0, 1] - abs(motion.forces[0, 0])

    return margin(0.0) / (margin(0.0) - margin(1.0))


@CONTROL_PERIODS
@pytest.mark.parametrize("excess", [-1e-6, 1e-6])
def test_contact_holds_up_to_static_friction_and_slides_with_the_friction_of_slip(period, excess):
    force = -largest_push() * (1.0 + excess)
    result = simulate(case(STATIC, push(0, 0.1, 0.001, force), period=period))
    trace = result.trace
    assert result.warnings == ()
    before = trace.times < 0.1
    assert np.all(trace.friction_coefficient[before] == 0.3)
    limit = trace.friction_coefficient * trace.normal_force
    margin = limit - np.abs(trace.tangential_force)
    np.testing.assert_allclose(trace.friction_margin, margin, atol=1e-12)
    at = int(np.flatnonzero(trace.times == 0.1)[-1])
    if excess < 0.0:
        assert 0.0 <= trace.friction_margin[at, 0] < 1e-4
        assert np.all(trace.phase[: at + 1] == ContactPhase.STICK)
        return
    assert told(result)[:2] == [(0, ContactPhase.SLIP_FORWARD), (1, ContactPhase.SLIP_BACKWARD)]
    assert np.all(trace.friction_coefficient[at] == 0.25)
    np.testing.assert_allclose(
        np.abs(trace.tangential_force[at]), 0.25 * trace.normal_force[at], rtol=1e-12
    )
    # The force does not fall below what holds by a little: it falls to mu_k at once.
    assert trace.slip_acceleration[at, 0] > 1.0


@pytest.mark.parametrize(
    ("preset", "key", "value"),
    [
        *(("paper-case-1", "controller.control_period", period) for period in (0.0, 0.001)),
        *(("spatial-prism", "simulation.friction", kind) for kind in ("cone", "pyramid")),
    ],
)
def test_equal_static_and_kinetic_friction_change_no_bit(preset, key, value):
    plain = with_values(load_scenario(preset), {key: value, "simulation.duration": 0.3})
    equal = {f"fingers.{i}.static_friction": f.friction for i, f in enumerate(plain.fingers)}
    same, other = (simulate(each).trace for each in (with_values(plain, equal), plain))
    assert same.to_rows().tobytes() == other.to_rows().tobytes()


HEAVY = {"estimates.4.initial": 0.5}
SAG = 0.5 * GRAVITY


@CONTROL_PERIODS
def test_edges_of_a_patch_are_crossed_at_the_exact_time_and_speed(period):
    """The block slides with m a = m g - 2 F_x whatever its friction; F_n follows the patch."""
    start, end = 0.01, 0.03
    wet = patch(0, "left", start, end, 0.6) | patch(1, "right", -end, -start, 0.6)
    result = simulate(case(HEAVY, wet, {"simulation.duration": 0.15}, period=period))
    trace = result.trace
    assert result.outcome is Outcome.COMPLETED
    # With held torques the hand learns of the patch at the next tick.
    tolerance = 1e-9 if period == 0.0 else 1e-4
    for contact in range(2):
        for (before, after), edge in zip(crossings(trace, contact), (start, end), strict=True):
            assert abs(abs(trace.slip[before, contact]) - edge) < 1e-12
            assert trace.slip[before, contact] == trace.slip[after, contact]
            assert trace.times[before] == pytest.approx(np.sqrt(2.0 * edge / SAG), abs=tolerance)
            speed = np.sqrt(2.0 * SAG * edge)
            assert abs(trace.slip_velocity[before, contact]) == pytest.approx(
                speed, abs=10.0 * tolerance
            )
    assert np.count_nonzero(np.diff(trace.times) == 0.0) == 3
    if period == 0.0:
        expected = 0.25 * GRAVITY / trace.friction_coefficient
        np.testing.assert_allclose(trace.normal_force[1:], expected[1:], atol=1e-7)
    np.testing.assert_allclose(trace.energy_residual, 0.0, atol=1e-9)


# The hand believes in its friction for good, and feels a patch.
STUBBORN = {
    "controller.lyapunov_weight": 0.0,
    "controller.estimate_norm_bound": 1e3,
    "estimates.0.initial": 0.25,
    "estimates.1.initial": 0.25,
    "estimates.2.initial": 0.5,
    "estimates.3.initial": 0.01042,
    "simulation.duration": 0.12,
    "simulation.relative_tolerance": 1e-10,
    "simulation.absolute_tolerance": 1e-12,
    "simulation.output_rate": 1e4,
}


@CONTROL_PERIODS
def test_a_patch_is_a_change_of_friction_at_the_instant_its_edge_is_crossed(period):
    """And the energy lost on it is the integral of friction over the way: work and energy."""
    values = {**STUBBORN, "controller.control_period": period}
    wet = patch(0, "left", 0.002, 0.006, 0.5)
    sliding = simulate(with_values(CASE_2, {**values, **wet})).trace
    (entry, _), (leave, _) = crossings(sliding, 0)
    times = [float(sliding.times[row]) for row in (entry, leave)]
    switched = change(0, times[0], "fingers.0.friction", 0.125)
    switched |= change(1, times[1], "fingers.0.friction", 0.25)
    other = simulate(with_values(CASE_2, {**values, **switched})).trace
    np.testing.assert_allclose(sliding.times, other.times, atol=1e-12)
    for name in ("object_pose", "slip", "slip_velocity", "normal_force", "joint_torque"):
        one, two = getattr(sliding, name), getattr(other, name)
        np.testing.assert_allclose(one, two, rtol=1e-9, atol=1e-9)
    assert sliding.slip[entry, 0] == pytest.approx(0.002, abs=1e-12)
    assert sliding.slip[leave, 0] == pytest.approx(0.006, abs=1e-12)
    on = slice(entry + 1, leave + 1)
    friction = 0.125 * sliding.normal_force[on, 0] * sliding.slip_velocity[on, 0]
    dry = 0.25 * sliding.normal_force[on, 1] * np.abs(sliding.slip_velocity[on, 1])
    lost = np.trapezoid(friction + dry, sliding.times[on])
    told_lost = sliding.dissipated_energy[leave] - sliding.dissipated_energy[entry]
    # Rows at 10 kHz; with held torques the force jumps between two of them.
    assert told_lost == pytest.approx(lost, rel=1e-3 if period else 1e-5)
    np.testing.assert_allclose(sliding.energy_residual, 0.0, atol=1e-9)


def test_patches_multiply_in_whatever_order_they_are_listed():
    spots = [(0.0, 0.004, 0.7), (0.002, 0.008, 1.3), (0.001, 0.003, 0.9)]
    runs = []
    for order in permutations(spots):
        values = dict(STUBBORN)
        for index, spot in enumerate(order):
            values |= patch(index, "left", *spot)
        runs.append(simulate(with_values(CASE_2, values)).trace)
    assert len({run.to_rows().tobytes() for run in runs}) == 1
    factors = dict.fromkeys(np.round(runs[0].friction_coefficient[:, 0] / 0.25, 12))
    assert list(factors) == [0.7, 0.63, 0.819, 0.91, 1.3, 1.0]


@CONTROL_PERIODS
@pytest.mark.parametrize(
    ("faces", "base"),
    [(("left", "right"), 0.0), (("bottom", "top"), 0.5 * np.pi), (("right", "left"), np.pi)],
)
def test_patches_lie_on_any_face(period, faces, base):
    """The hand of case I turned about the object, lifting it instead of holding its weight."""
    turn = np.array([[np.cos(base), -np.sin(base)], [np.sin(base), np.cos(base)]])
    values = {
        "object.half_width": 0.12,
        "object.face_half_length": 0.12,
        "simulation.gravity": 0.0,
        "controller.control_period": period,
        "simulation.duration": 0.15,
        "trajectory.acceleration": [*(turn @ [0.0, GRAVITY]).tolist(), 0.0],
    }
    centre = np.array([1.466, 0.366])
    for i, face in enumerate(faces):
        x, y = turn @ (np.array(CASE_1.fingers[i].base) - centre) + centre
        values |= {f"fingers.{i}.face": face, f"fingers.{i}.base": [float(x), float(y)]}
    values |= patch(0, faces[0], 5e-4, 1e-3, 0.8) | patch(1, faces[1], -0.02, -1e-3, 0.9)
    trace = simulate(with_values(CASE_1, values)).trace
    assert set(np.round(trace.friction_coefficient[:, 0] / 0.25, 12)) == {1.0, 0.8}
    assert set(np.round(trace.friction_coefficient[:, 1] / 0.25, 12)) == {1.0, 0.9}
    np.testing.assert_allclose(trace.energy_residual, 0.0, atol=1e-9)
    for contact, edge in ((0, 5e-4), (1, -1e-3)):
        row, _ = crossings(trace, contact)[0]
        assert trace.slip[row, contact] == pytest.approx(edge, abs=1e-12)


@CONTROL_PERIODS
def test_patch_appears_dries_and_changes_like_the_friction_it_stands_for(period):
    values = {"controller.control_period": period, "controller.grip_safety": 1.5}
    spot = patch(0, "left", -0.1, 0.1, 0.8, start_time=1.0, end_time=3.0)
    spot |= change(0, 2.0, "patches.0.friction_factor", 0.4)
    frictions = {1.0: 0.25 * 0.8, 2.0: 0.25 * 0.4, 3.0: 0.25}
    changes = {}
    for index, (t, friction) in enumerate(frictions.items()):
        changes |= change(index, t, "fingers.0.friction", friction)
    one, two = (simulate(with_values(CASE_2, {**values, **v})) for v in (spot, changes))
    assert one.phase_changes == two.phase_changes
    assert one.trace.to_rows().tobytes() == two.trace.to_rows().tobytes()


@pytest.mark.parametrize("factor", [0.2, 5.0])
@CONTROL_PERIODS
def test_contact_that_starts_on_an_edge_neither_loops_nor_leaves_its_face(period, factor):
    """At rest on an edge the smaller friction counts, on whichever side the patch lies."""
    for start, end in ((-0.05, 0.0), (0.0, 0.05)):
        values = {**patch(0, "left", start, end, factor), "controller.control_period": period}
        result = simulate(with_values(CASE_2, {**values, "simulation.duration": 0.5}))
        assert result.outcome in (Outcome.COMPLETED, Outcome.SEPARATED, Outcome.DIVERGED)
        assert result.trace.friction_coefficient[0, 0] == 0.25 * min(factor, 1.0)
        assert np.all(np.diff(result.trace.times) >= 0.0)


@CONTROL_PERIODS
def test_object_that_becomes_heavier_keeps_its_velocity_and_brings_its_energy(period):
    pour = change(0, 0.5, "object.mass", 1.6) | change(1, 0.5, "object.inertia", 0.016672)
    values = {**pour, "controller.control_period": period, "controller.grip_safety": 2.0}
    trace = simulate(with_values(CASE_1, {**values, "simulation.duration": 1.0})).trace
    before, after = np.flatnonzero(trace.times == 0.5)
    np.testing.assert_array_equal(trace.object_velocity[before], trace.object_velocity[after])
    x, y, turn = trace.object_velocity[before]
    kinetic = 0.5 * 0.6 * (x**2 + y**2) + 0.5 * 0.006252 * turn**2
    potential = 0.6 * GRAVITY * trace.object_pose[before, 1]
    brought = trace.supplied_energy[after] - trace.supplied_energy[before]
    assert brought == pytest.approx(kinetic + potential, rel=1e-12)
    np.testing.assert_allclose(trace.energy_residual, 0.0, atol=1e-9)


@pytest.mark.parametrize("name", ["wet-patch", "poured-mass"])
def test_presets_show_slip_that_starts_at_three_seconds(name):
    result = simulate(load_scenario(name))
    assert result.phase_changes[0].time == 3.0
    assert np.all(np.abs(result.trace.energy_residual) < 1e-9)


def test_changes_at_one_instant_are_allowed_together():
    """Neither alone would be: static friction may not lie below that of slip."""
    values = change(0, 1.0, "fingers.0.friction", 0.5)
    values |= change(1, 1.0, "fingers.0.static_friction", 0.6)
    values |= {"fingers.0.static_friction": 0.3}
    assert len(with_values(CASE_1, values).changes) == 2
