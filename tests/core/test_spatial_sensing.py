"""What the controller measures of a spatial hand, and what the joints make of its commands."""

from itertools import repeat
from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from slipgrasp.core.kernel.spatial.state import parts_of
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.core.test_sensing import detected
from tests.references.noise import normal_numbers
from tests.references.spatial_composite import Composite, Instant
from tests.references.spatial_law import regressor, tracking_errors
from tests.references.spatial_plant import Phase, State, all_stick
from tests.references.spatial_scenarios import world_of
from tests.spatial_evaluation import SpatialEvaluation

PRISM = load_scenario("spatial-prism")
COMPOSITE = load_scenario("spatial-composite")
PERIOD = 1e-3
SHORT = {"simulation.duration": 0.12, "simulation.output_rate": 1000.0}
# Noise of the plane's noisy preset, and settings for it.
NOISY = with_values(
    COMPOSITE,
    {
        **SHORT,
        "sensing.position_noise": 1e-5,
        "sensing.velocity_noise": 1e-3,
        "sensing.true_accelerations": False,
        "controller.velocity_gain": 20.0,
        "controller.force_noise": 0.3,
        "controller.velocity_noise": 1e-3,
    },
)
OFF = [
    {"sensing.acceleration_filter_time": 0.05},
    {"sensing.slip_threshold": 0.1, "sensing.slip_delay": 0.1},
    {"sensing.slip_detector": "cumulative-sum", "sensing.slip_delay_deviation": 0.1},
    {"simulation.seed": 5, "controller.velocity_noise": 1e-3},
    {"actuation.torque_limit": 1e6, "actuation.torque_rate_limit": 1e9},
]


class Moment(NamedTuple):
    """What the law knew at a tick, and what was true."""

    time: float
    true: State
    measured: State
    phase: Phase  # believed
    acceleration: np.ndarray  # as measured, (6 + 2n,)
    torques: np.ndarray  # that belong to it, (n, 3)
    commanded: np.ndarray  # (n, 3)
    acting: np.ndarray  # torques from now on, (n, 3)
    estimates: np.ndarray
    rates: np.ndarray  # of the estimates until the next tick


def state_of(record, n):
    parts = parts_of(record, n)
    return State(
        parts.pose[:3].copy(),
        parts.pose[3:].copy(),
        parts.velocity.copy(),
        parts.slip.reshape(n, 2).copy(),
        parts.slip_velocity.reshape(n, 2).copy(),
    )


def moments_of(scenario, monkeypatch):
    """Every tick but the first, before anything has moved on."""
    monkeypatch.setattr("slipgrasp.core.run.computation._STEPS_PER_PIECE", 1)
    simulation, found = Simulation(scenario), []
    run, n, p = simulation._run, len(scenario.fingers), len(scenario.estimates)
    senses, seen = run.senses, 1
    while not simulation.finished:
        simulation.advance()
        if senses.num_ticks == seen or simulation.finished:
            continue
        seen = int(senses.num_ticks)
        found.append(
            Moment(
                simulation.time,
                state_of(run.step.start, n),
                state_of(senses.measured, n),
                Phase(senses.slips[:n] == 0.0, senses.gamma[:n, :2].copy()),
                senses.acceleration[: 6 + 2 * n].copy(),
                senses.torques[:n].copy(),
                run.discrete.commanded[:n].copy(),
                run.discrete.torques[:n].copy(),
                run.discrete.estimates[:p].copy(),
                run.pending_rates[:p].copy(),
            )
        )
    return found


def turn_between(measured, true):
    """Rotation vector, in the axes of the world, from a true attitude to a measured one."""
    first, second = (Rotation.from_quat(np.roll(q, -1)) for q in (true, measured))
    return (second * first.inv()).as_rotvec()


def errors_of(moment):
    """What is measured less what is true: positions, then velocities, ``(2 (6 + 2n),)``."""
    measured, true = moment.measured, moment.true
    return np.concatenate(
        [
            measured.position - true.position,
            turn_between(measured.quaternion, true.quaternion),
            np.ravel(measured.slip - true.slip),
            measured.velocity - true.velocity,
            np.ravel(measured.slip_velocity - true.slip_velocity),
        ]
    )


def drawn(seed, ticks, channels):
    """Number k of a tick: the first of pair k of the stream of docs/model.md."""
    return normal_numbers(seed, ticks, 2 * channels)[:, ::2]


def test_noise_is_as_strong_as_stated_and_drawn_from_the_seed_and_the_tick_alone(monkeypatch):
    place, speed = 2e-5, 3e-3
    values = {
        **SHORT,
        "sensing.position_noise": place,
        "sensing.velocity_noise": speed,
        "simulation.seed": 2**31 - 9,
    }
    moments = moments_of(with_values(PRISM, values), monkeypatch)
    errors = np.array([errors_of(moment) for moment in moments])
    assert errors.shape == (119, 24)
    assert errors[:, :12].std() == pytest.approx(place, rel=0.05)
    assert errors[:, 12:].std() == pytest.approx(speed, rel=0.05)
    assert np.abs(errors[:, 12:].mean(axis=0)).max() < 4.0 * speed / np.sqrt(119)
    assert np.abs(np.corrcoef(errors.T) - np.eye(24)).max() < 0.45
    numbers = drawn(2**31 - 9, 120, 24)[1:]
    assert_allclose(errors[:, :12], place * numbers[:, :12], atol=1e-12)
    assert_allclose(errors[:, 12:], speed * numbers[:, 12:], atol=1e-12)


@pytest.mark.parametrize("values", OFF)
def test_what_is_off_leaves_every_bit_as_it_was(values):
    short = with_values(COMPOSITE, SHORT)
    plain = simulate(short).trace.to_rows()
    assert np.array_equal(simulate(with_values(short, values)).trace.to_rows(), plain)


def test_noise_is_the_same_however_the_run_is_cut_and_another_with_another_seed(monkeypatch):
    whole = simulate(NOISY).trace.to_rows()
    other = simulate(with_values(NOISY, {"simulation.seed": 1})).trace.to_rows()
    assert not np.array_equal(whole[:, :20], other[: len(whole), :20])
    monkeypatch.setattr("slipgrasp.core.run.computation._STEPS_PER_PIECE", 7)
    assert np.array_equal(simulate(NOISY).trace.to_rows(), whole)


@pytest.mark.parametrize(
    ("preset", "friction"), [("spatial-prism", "cone"), ("spatial-unknown-friction", "pyramid")]
)
def test_the_theorems_command_and_learn_from_what_is_measured(preset, friction, monkeypatch):
    """Torques and rates of the NumPy reference at the measured state, and not at the true one."""
    values = {
        **SHORT,
        "simulation.duration": 0.02,
        "simulation.friction": friction,
        "controller.distribution": "hold",
        "controller.grip_safety": 1.05,
        "sensing.position_noise": 1e-4,
        "sensing.velocity_noise": 5e-3,
        "sensing.acceleration_noise": 0.2,
    }
    scenario = with_values(load_scenario(preset), values)
    world = world_of(scenario)
    law, hand = world.law, world.hand
    compared = 0
    for moment in moments_of(scenario, monkeypatch):
        rates, torques = {}, {}
        for name in ("measured", "true"):
            state, phase = getattr(moment, name), moment.phase
            kin, spin = hand.kinematics(state), state.velocity[3:]
            desired = world.desired(moment.time)
            believed = world.unknowns.fill(moment.estimates)
            errors = tracking_errors(state, kin.rotation, desired)
            v = law.commanded_acceleration(errors, phase, desired)
            command = law.command(hand, kin, believed, phase, v, spin)
            torques[name] = command.torques
            M = hand.reduced_form(kin, believed, phase, spin).M
            U, _ = regressor(hand, kin, world.unknowns, phase, moment.acceleration, spin)
            gradient = U.T @ law.weighted_errors(M, errors)
            pull = law.leakage(moment.estimates) * moment.estimates
            rates[name] = law.adaptation_gain * gradient - pull
        if command.violation > 1e-7:
            continue
        compared += 1
        size = np.abs(torques["measured"]).max()
        assert_allclose(moment.commanded, torques["measured"], atol=1e-8 * size)
        assert np.abs(moment.commanded - torques["true"]).max() > 1e-4 * size
        size = np.abs(rates["measured"]).max()
        assert_allclose(moment.rates, rates["measured"], atol=1e-8 * size)
        assert np.abs(moment.rates - rates["true"]).max() > 1e-4 * size
    assert compared > 10


def noise_of_rows(now, estimates):
    """Squared length of each row's slope over the accelerations that are believed not to be 0."""
    moves = np.append(np.ones(6, bool), ~now.phase.sticks.ravel())
    base = now.missing(estimates)
    units = np.eye(len(moves))[moves]
    slopes = [
        now._replace(acceleration=now.acceleration + unit).missing(estimates) - base
        for unit in units
    ]
    return np.sum(np.square(slopes), axis=0)


@pytest.mark.parametrize("friction", ["cone", "pyramid"])
def test_the_composite_law_learns_from_what_is_measured_row_by_row(friction, monkeypatch):
    """Recursive least squares of the reference, each row with the variance that noise gives it."""
    values = {"simulation.friction": friction, "simulation.duration": 0.03}
    scenario = with_values(NOISY, values)
    world, time = world_of(scenario), scenario.sensing.acceleration_filter_time
    composite = Composite(world.learning)
    share = PERIOD / (time + PERIOD)
    variance = 2.0 * (1e-3 / (time + PERIOD)) ** 2 / (2.0 - share)
    since, before = np.zeros(3), np.zeros((3, 2), bool)
    for k, moment in enumerate(moments_of(scenario, monkeypatch), start=1):
        state = moment.measured
        kin, spin = world.hand.kinematics(state), state.velocity[3:]
        slipping = ~moment.phase.sticks
        since[np.any(slipping != before, axis=1)] = moment.time
        before = slipping
        acceleration = moment.acceleration.copy()
        acceleration[6:][moment.phase.sticks.ravel()] = 0.0
        errors = tracking_errors(state, kin.rotation, world.desired(moment.time))
        believed = world.unknowns.fill(moment.estimates)
        M = world.hand.reduced_form(kin, believed, moment.phase, spin).M
        U, _ = regressor(world.hand, kin, world.unknowns, moment.phase, acceleration, spin)
        gradient = U.T @ world.law.weighted_errors(M, errors)
        now = Instant(
            world.hand, kin, world.unknowns, moment.phase, moment.torques, acceleration, spin
        )
        trust = min(1.0, k * PERIOD / (time + PERIOD))
        own = 1.0 - np.exp((since - moment.time) / time)
        rows = [trust] * 6
        for i in range(3):
            ways = int(slipping[i].any()) if friction == "cone" else int(slipping[i].sum())
            rows += [trust * own[i]] * ways
        learnt = composite.learn(
            now,
            moment.estimates,
            gradient,
            PERIOD,
            noise=variance * noise_of_rows(now, moment.estimates),
            trust=np.array(rows),
        )
        assert_allclose(moment.estimates + PERIOD * moment.rates, learnt, rtol=1e-6, atol=1e-8)


def test_accelerations_are_filtered_differences_of_what_is_measured(monkeypatch):
    scenario = with_values(NOISY, {"simulation.duration": 0.05})
    moments = moments_of(scenario, monkeypatch)
    velocities = [
        np.append(moment.measured.velocity, moment.measured.slip_velocity) for moment in moments
    ]
    # After its start, where it is the mean of all so far.
    share = PERIOD / (scenario.sensing.acceleration_filter_time + PERIOD)
    for k in range(10, len(moments)):
        slope = (velocities[k] - velocities[k - 1]) / PERIOD
        wanted = (1.0 - share) * moments[k - 1].acceleration + share * slope
        assert_allclose(moments[k].acceleration, wanted, rtol=1e-9, atol=1e-9)
        wanted = (1.0 - share) * moments[k - 1].torques + share * moments[k - 1].acting
        assert_allclose(moments[k].torques, wanted, rtol=1e-9)


def slip_velocities(moments):
    return np.array([moment.measured.slip_velocity for moment in moments])


def by_sums(velocities, threshold, bound, share):
    """Crosier's sum of vectors in stick, Page's along the filtered velocity in slip."""
    level, slips, total, end = 0.5 * threshold, False, np.zeros(2), 0.0
    slide, direction, beliefs = np.zeros(2), np.zeros(2), []
    for velocity in velocities:
        slide = slide + share * (velocity - slide)
        if slips:
            end = max(0.0, end + level - direction @ velocity)
            slips = end <= bound
        else:
            total = total + velocity
            size = np.linalg.norm(total)
            total = total * (1.0 - min(1.0, level / size)) if size > 0.0 else total
            slips = size - level > bound
        if slips != (beliefs[-1] if beliefs else False):
            total, end = np.zeros(2), 0.0
        direction = slide / np.linalg.norm(slide) if slips else np.zeros(2)
        beliefs.append(slips)
    return beliefs


DETECTING = {
    **SHORT,
    "simulation.duration": 0.1,
    "sensing.true_phases": False,
    "sensing.velocity_noise": 1e-3,
    "controller.velocity_noise": 1e-3,
}


@pytest.mark.parametrize("detector", ["threshold", "cumulative-sum"])
def test_slip_is_detected_in_the_plane_of_the_face(detector, monkeypatch):
    scenario = with_values(PRISM, {**DETECTING, "sensing.slip_detector": detector})
    moments = moments_of(scenario, monkeypatch)
    velocities, times = slip_velocities(moments), [moment.time for moment in moments]
    believed = np.array([~moment.phase.sticks[:, 0] for moment in moments])
    for i in range(3):
        if detector == "threshold":
            speeds = np.append(0.0, np.linalg.norm(velocities[:, i], axis=1))
            wanted = detected(speeds, [0.0, *times], 0.005, repeat(0.002))[1:]
        else:
            bound = max(10.0 * 1e-3**2 / 0.0025, 0.0025 * 0.002 / PERIOD)
            wanted = by_sums(velocities[:, i], 0.005, bound, PERIOD / (0.006 + PERIOD))
        assert np.array_equal(believed[:, i], wanted)
        assert np.any(wanted)
    directions = np.linalg.norm([moment.phase.directions for moment in moments], axis=2)
    assert_allclose(directions, believed, atol=1e-12)


def test_cones_that_no_squeeze_meets_are_widened_where_noise_is_expected():
    """Contacts 40 mm apart in height, with friction believed too low for any squeeze."""
    values = {
        "fingers.0.contact_offset": [0.02, 0.0],
        "fingers.1.contact_offset": [-0.02, 0.0],
        **{f"estimates.{i}.initial": 0.06 for i in range(3)},
    }
    scenario = with_values(load_scenario("spatial-composite-noisy"), values)
    world = world_of(scenario)
    rest = np.zeros((3, 2))
    start = State(world.position, np.array(world.quaternion), np.zeros(6), rest, rest)
    evaluation = SpatialEvaluation(scenario, start, all_stick(3), world.estimates)
    evaluation.command()
    forces = evaluation.work.grasp.force[:9].reshape(3, 3)
    kin = world.hand.kinematics(start)
    believed = world.unknowns.fill(world.estimates)
    errors = tracking_errors(start, kin.rotation, world.desired(0.0))
    v = world.law.commanded_acceleration(errors, all_stick(3), world.desired(0.0))
    M_o, h_o = world.hand.object_dynamics(kin, believed, np.zeros(3))
    assert_allclose(kin.W @ forces.ravel(), M_o @ v[:6] + h_o, atol=1e-9)
    assert forces[:, 2].min() >= 4.0 - 1e-9
    widest = np.max(np.linalg.norm(forces[:, :2], axis=1) / forces[:, 2])
    steps = np.log(widest / (0.06 / 1.1)) / np.log(1.25)
    assert steps == pytest.approx(round(steps), abs=1e-6)
    assert steps > 0.5
    narrower = believed._replace(friction=believed.friction * 1.25 ** (round(steps) - 1))
    told = world.law.command(world.hand, kin, narrower, all_stick(3), v, np.zeros(3))
    assert told.violation > 1e-3
    # The trace says by how much the believed cones are left; without noise the least is taken.
    assert evaluation.discrete.violation > told.violation
    quiet = with_values(scenario, {"controller.velocity_noise": 0.0})
    least = SpatialEvaluation(quiet, start, all_stick(3), world.estimates)
    least.command()
    assert least.discrete.violation == evaluation.discrete.violation
    assert least.work.grasp.force[2] < forces[0, 2]
