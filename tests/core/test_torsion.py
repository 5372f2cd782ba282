"""Soft fingertips: contacts of spatial hands that resist turning about their normal."""

import numpy as np
import pytest

from benchmarks.torsion import end_of_turn
from slipgrasp.core.kernel.compilation.compiler import call
from slipgrasp.core.kernel.compilation.records import make_record
from slipgrasp.core.kernel.spatial.flow import spatial_plant
from slipgrasp.core.kernel.spatial.model import pack_model
from slipgrasp.core.kernel.spatial.state import (
    STATE,
    parts_of,
)
from slipgrasp.core.kernel.spatial.torsion_equations import spatial_mobility
from slipgrasp.core.kernel.spatial.torsion_layout import ROWS
from slipgrasp.core.kernel.spatial.torsion_stops import spatial_keep_stick
from slipgrasp.core.kernel.spatial.workspace import DISCRETE, SLIP, STICK, WORKSPACE
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.custom_laws import forget
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.scenario.pads import LEAST_ECCENTRICITY, PAD_FACTORS
from slipgrasp.core.trace.types import Outcome
from tests.core.test_chains import as_chains
from tests.references.box_on_rigid_tips import RigidTips
from tests.references.spatial_hands import random_state
from tests.references.spatial_scenarios import random_spatial_scenario
from tests.soft_box import OFFSET, JointSprings, SlideSprings, soft_box

pytestmark = pytest.mark.slow

PHASES = ("slip", "stick", "mixed")


@pytest.fixture(autouse=True)
def _unknown_laws():
    yield
    for law in (JointSprings, SlideSprings):
        forget(law.name)


def soft(scenario, radius=0.015, values=None):
    """The scenario with soft fingertips everywhere, and other changes."""
    pads = {f"fingers.{i}.pad_radius": radius for i in range(len(scenario.fingers))}
    return with_values(scenario, pads | (values or {}))


KNOWING = {"controller.kind": "pd-gravity", "controller.distribution": "hold"}
"""A law that goes with soft fingertips."""


class Hand:
    """A soft hand at a random state, by the units of the kernel."""

    def __init__(self, n, seed, phases, shape="prism"):
        rng, values = np.random.default_rng([n, seed]), {**KNOWING, "object.shape": shape}
        self.n, scenario = n, soft(random_spatial_scenario(rng, n, "masses"), values=values)
        self.body = scenario.object
        at = random_state(rng, n)
        self.model = pack_model(scenario, [0.0] * 6)
        self.discrete, self.work = make_record(DISCRETE), make_record(WORKSPACE)
        self.state = make_record(STATE)
        parts = parts_of(self.state, n)
        parts.pose[:], parts.velocity[:] = (*at.position, *at.quaternion), at.velocity
        parts.slip[:], parts.slip_velocity[:] = at.slip.ravel(), at.slip_velocity.ravel()
        sticks = {"slip": [False] * n, "stick": [True] * n, "mixed": [True] + [False] * (n - 1)}
        for i, stuck in enumerate(sticks[phases]):
            self.discrete.phases[i] = STICK if stuck else SLIP
            self.discrete.slips[i] = 0.0 if stuck else 1.0
            if stuck:
                parts.slip_velocity[2 * i : 2 * i + 2] = 0.0
        self.discrete.torques[:n] = rng.uniform(-10.0, 10.0, (n, 3))
        self.evaluate(self.state)
        self.keep_stick(self.state)
        self.evaluate(self.state)

    def evaluate(self, state):
        call(spatial_plant, self.model, self.discrete, state, self.work)

    def keep_stick(self, state):
        call(spatial_keep_stick, self.model, self.discrete, state, self.work)

    @property
    def spins(self):
        """e psi' of every contact [m/s]."""
        return parts_of(self.state, self.n).scaled_spin_velocity

    @property
    def has_undetermined_moments(self):
        """Whether some moments of contacts that stick move nothing, so that they may creep."""
        return self.work.torsion.num_determined < self.work.torsion.num_holders

    @property
    def coordinate_scales(self):
        """Rates of the coordinates of slips per slip velocity: not 1 on a sphere."""
        if self.body.shape != "sphere":
            return np.ones(2 * self.n)
        slips = parts_of(self.state, self.n).slip.reshape(-1, 2)
        return np.repeat(1.0 + 0.25 * (slips**2).sum(axis=1) / self.body.radius**2, 2)

    def moved(self, time):
        """The state after a short time under the present accelerations, spins from velocities."""
        state, parts = make_record(STATE), parts_of(self.state, self.n)
        state.x[:] = self.state.x
        new, spin = parts_of(state, self.n), parts.velocity[3:]
        new.pose[:3] += time * parts.velocity[:3]
        w, v = parts.pose[3], parts.pose[4:]
        new.pose[3] -= 0.5 * time * spin @ v
        new.pose[4:] += 0.5 * time * (w * spin + np.cross(spin, v))
        new.pose[3:] /= np.linalg.norm(new.pose[3:])
        new.velocity[:] += time * self.work.acceleration
        new.slip[:] += time * self.coordinate_scales * parts.slip_velocity
        new.slip_velocity[:] += time * self.work.slip_acceleration[: self.n].ravel()
        return state


HANDS = [(n, seed, "prism") for n, seed in ((2, 0), (3, 0), (3, 1), (4, 0))]
ROUND = [(n, 0, shape) for n in (2, 4) for shape in ("cylinder", "sphere")]


@pytest.mark.parametrize("phases", PHASES)
@pytest.mark.parametrize(("n", "seed", "shape"), HANDS + ROUND)
def test_the_spin_acceleration_is_the_difference_quotient_of_the_spin_velocity(
    n, seed, shape, phases
):
    hand, step = Hand(n, seed, phases, shape), 1e-6
    stated = hand.work.spin_acceleration[:n].copy()
    sticks, may_creep = hand.discrete.phases[:n] == STICK, hand.has_undetermined_moments
    # Every contact slips for a moment, so that its spin velocity is that of its velocities.
    moved = [hand.moved(time) for time in (-step, step)]
    hand.discrete.phases[:n] = SLIP
    spins = []
    for state in moved:
        hand.evaluate(state)
        hand.keep_stick(state)
        spins.append(parts_of(state, n).scaled_spin_velocity.copy())
    found = (spins[1] - spins[0]) / (2.0 * step)
    np.testing.assert_allclose(found, stated, atol=1e-6 * (1.0 + np.abs(found).max()))
    assert may_creep or (stated[sticks] == 0.0).all()


@pytest.mark.parametrize("phases", PHASES)
@pytest.mark.parametrize(("n", "seed"), [(2, 0), (3, 0), (3, 1), (4, 0)])
def test_forces_and_accelerations_agree_in_contact_space_too(n, seed, phases):
    hand = Hand(n, seed, phases)
    work, torsion = hand.work, hand.work.torsion
    forces = np.column_stack((work.forces[:n, :2], work.moments[:n], work.forces[:n, 2]))
    stated = np.column_stack((work.slip_acceleration[:n], work.spin_acceleration[:n], np.zeros(n)))
    call(spatial_mobility, hand.model, hand.state, work)
    G, c = torsion.mobility[: ROWS * n, : ROWS * n], torsion.offset[: ROWS * n]
    np.testing.assert_allclose(G, G.T, atol=1e-12 * np.abs(G).max())
    found = (G @ forces.ravel() + c).reshape(n, ROWS)
    scale = np.abs(G).max() * np.abs(forces).max() + np.abs(c).max()
    np.testing.assert_allclose(found, stated, atol=1e-12 * scale)


@pytest.mark.parametrize("phases", PHASES)
@pytest.mark.parametrize(("n", "seed"), [(2, 0), (3, 0), (3, 1), (4, 0)])
def test_friction_lies_on_its_ball_where_a_contact_slips_and_against_the_slip(n, seed, phases):
    hand = Hand(n, seed, phases)
    work, parts = hand.work, parts_of(hand.state, n)
    for i in range(n):
        if hand.discrete.phases[i] == STICK:
            assert abs(hand.spins[i]) < 1e-13 or hand.has_undetermined_moments
            continue
        slide = np.append(parts.slip_velocity[2 * i : 2 * i + 2], hand.spins[i])
        bound = hand.model.truth.friction[i] * work.forces[i, 2]
        friction = np.append(work.forces[i, :2], work.moments[i])
        wanted = -bound * slide / np.linalg.norm(slide)
        np.testing.assert_allclose(friction, wanted, rtol=1e-12, atol=1e-12)


def last_stops(result):
    """When each contact last began to stick [s]."""
    return [
        max(c.time for c in result.phase_changes if c.contact == i and c.to_phase == 0)
        for i in range(2)
    ]


def excess(result):
    """How far a wrench is outside its limit surface at most, as a share of it.

    Rows just before a jump have what stick would have needed then.
    """
    trace, fingers = result.trace, result.scenario.fingers
    e = np.array([finger.eccentricity for finger in fingers])
    moment = np.divide(trace.torsional_moment, e, out=np.zeros((len(trace), len(e))), where=e > 0)
    size = np.sqrt(trace.tangential_size**2 + moment**2)
    bound = trace.friction_coefficient * trace.normal_force
    jumps = np.append(np.diff(trace.times) == 0.0, False)
    return float(((size - bound) / bound)[~jumps].max())


def test_a_box_off_its_centre_of_mass_turns_and_stops():
    """Continuous control: 0.733696 rad at 1.15218 s, way 4.13146 mm, slip 3.76897, 1.45677 mm."""
    runs = [simulate(soft_box(0.01, period, 1.3)) for period in (1e-3, 5e-4)]
    coarse, fine = (
        np.array(
            [
                abs(run.metrics.spin_end[0]),
                last_stops(run)[0],
                run.metrics.slip_path[0],
                run.trace.slip[-1, 0],
                run.trace.dissipated_energy[-1],
            ]
        )
        for run in runs
    )
    wanted = np.array([0.733696, 1.15218, 4.13146e-3, 3.76897e-3, 0.168407])
    np.testing.assert_allclose(2.0 * fine - coarse, wanted, rtol=1e-5)
    for run in runs:
        assert run.outcome is Outcome.COMPLETED
        assert last_stops(run)[0] == pytest.approx(last_stops(run)[1], abs=1e-9)
        # The mirror image: one fingertip turns as the other, seen along its own normal.
        assert run.metrics.spin_end[0] == pytest.approx(-run.metrics.spin_end[1], rel=1e-9)
        assert run.trace.slip[-1, 0] == pytest.approx(run.trace.slip[-1, 2], rel=1e-9)
        assert np.abs(run.trace.energy_residual).max() < 2e-9
        assert excess(run) < 1e-9
        assert np.diff(run.trace.dissipated_energy).min() > -1e-12


def test_a_box_turns_between_the_jaws_of_a_gripper_too():
    """Continuous control: 0.733804 rad at 1.153308 s, way 4.13218 mm."""
    run = simulate(soft_box(0.01, 2.5e-4, 1.3, "slides"))
    assert abs(run.metrics.spin_end[0]) == pytest.approx(0.733804, rel=1e-5)
    assert last_stops(run) == pytest.approx([1.153308] * 2, rel=1e-5)
    assert run.metrics.slip_path[1] == pytest.approx(4.13218e-3, rel=1e-5)
    assert np.abs(run.trace.energy_residual).max() < 1e-8


def test_the_box_turns_as_on_rigid_tips_where_the_slides_are_stiff():
    """0.733810 rad at 1.15329 s, path 4.13222 mm; at 1e5 N/m 0.7338099, 1.1532968, 4.132215."""
    rigid = RigidTips(eccentricity=0.01).turn()
    assert rigid[:3] == pytest.approx((0.733810, 1.15329, 4.13222e-3), rel=3e-6)
    stiff = end_of_turn(1e5)
    np.testing.assert_allclose(stiff, (0.7338099, 1.1532968, 4.132215e-3), rtol=3e-7)
    np.testing.assert_allclose(stiff, rigid[:3], rtol=4e-6)


def test_a_slip_that_turns_back_stops_and_begins_at_one_time():
    """Continuous control: 2.303 rad at 0.8297 s, and for good 1.382737 rad at 2.237505 s."""
    run = simulate(soft_box(0.003, 1e-3, 2.4))
    trace, changes = run.trace, run.phase_changes
    farthest = float(trace.times[np.abs(trace.spin[:, 0]).argmax()])
    assert farthest == pytest.approx(0.8297, abs=2e-3)
    assert np.abs(trace.spin[:, 0]).max() == pytest.approx(2.303, abs=5e-3)
    turning = [(c.time, c.from_phase, c.to_phase) for c in changes if c.contact == 0][1:3]
    assert turning == [(pytest.approx(farthest, abs=1e-3), 2, 0), (turning[0][0], 0, 2)]
    assert last_stops(run)[0] == pytest.approx(2.237505, rel=2e-3)
    assert abs(run.metrics.spin_end[0]) == pytest.approx(1.382737, rel=5e-3)
    assert run.metrics.slip_path[0] == pytest.approx(5.967204e-3, rel=5e-3)
    assert run.metrics.phase_change_count == len(changes)
    assert excess(run) < 1e-9


@pytest.mark.parametrize(("eccentricity", "turns"), [(0.011, True), (0.0115, False)])
def test_the_box_turns_only_where_friction_cannot_hold_its_moment(eccentricity, turns):
    """The border is e = 11.26 mm."""
    result = simulate(soft_box(eccentricity, 1e-3, 0.6))
    assert (max(map(abs, result.metrics.spin_end)) > 1e-3) == turns
    assert turns or np.abs(result.trace.object_pose[-1, 4]) < 1e-8


def test_the_closed_form_written_as_a_chain_turns_alike():
    scenario = soft(load_scenario("spatial-composite"), values={"simulation.duration": 0.1})
    closed, chain = simulate(scenario), simulate(as_chains(scenario))
    ours, theirs = ([(c.contact, c.to_phase) for c in run.phase_changes] for run in (chain, closed))
    assert ours == theirs
    np.testing.assert_allclose(chain.metrics.spin_end, closed.metrics.spin_end, rtol=1e-6)
    np.testing.assert_allclose(chain.metrics.slip_path, closed.metrics.slip_path, rtol=1e-6)
    assert np.abs(chain.trace.energy_residual).max() < 2e-9


def test_a_pad_that_is_no_larger_than_a_point_changes_no_bit():
    scenario = with_values(load_scenario("spatial-composite"), {"simulation.duration": 0.2})
    hard, point = (
        simulate(scenario),
        simulate(soft(scenario, LEAST_ECCENTRICITY / PAD_FACTORS["even"] * 0.999)),
    )
    assert np.array_equal(hard.trace.to_rows(), point.trace.to_rows())


HALF_WEIGHT = 0.5 * 9.81


@pytest.mark.parametrize("law", ["composite", "certainty-equivalence"])
@pytest.mark.parametrize("eccentricity", [0.006, 0.012])
def test_a_law_that_holds_presses_as_hard_as_load_and_moment_ask(law, eccentricity):
    values = {"controller.kind": law, "controller.grip_safety": 1.1}
    run = simulate(with_values(soft_box(eccentricity, 1e-3, 0.5), values))
    needed = np.hypot(HALF_WEIGHT, HALF_WEIGHT * OFFSET / eccentricity)
    np.testing.assert_allclose(run.trace.normal_force[-1], 1.1 / 0.5 * needed, rtol=1e-6)
    moments = np.abs(run.trace.torsional_moment[-1])
    np.testing.assert_allclose(moments, HALF_WEIGHT * OFFSET, rtol=1e-6)
    assert run.metrics.slip_path == (0.0, 0.0)
    # Nothing turns the object about the line of the contacts but a slip.
    assert run.trace.input_rank[-1] == 5.0
    assert run.trace.controllability[-1, 3] < 1e-3
    # Both contacts turn about one line: nothing says which of them carries the moment.
    (warning,) = run.warnings
    assert (warning.code, warning.count, warning.first_time) == ("torsion_split", 1, 0.0)


def test_the_moment_of_a_single_pad_is_determined():
    values = {"simulation.duration": 0.1, "fingers.0.pad_radius": 0.015}
    run = simulate(with_values(load_scenario("spatial-composite"), values))
    assert run.outcome is Outcome.COMPLETED
    assert "torsion_split" not in {warning.code for warning in run.warnings}


def test_a_custom_law_sees_spins_and_moments():
    run = simulate(soft_box(0.01, 1e-3, 0.3))
    trace, tick = run.trace, 250
    row = np.searchsorted(trace.times, tick * 1e-3)
    seen = dict(zip(JointSprings.diagnostics, run.ticks.diagnostics[tick], strict=True))
    assert seen["spin"] == pytest.approx(trace.spin[row, 0], rel=1e-12)
    assert seen["rate"] == pytest.approx(trace.spin_velocity[row, 0], rel=1e-12)
    # The row has the moment under the next torque.
    assert seen["moment"] == pytest.approx(-trace.torsional_moment[row, 0], rel=1e-5)
    assert seen["reach"] == pytest.approx(0.01)


@pytest.mark.parametrize(("radii", "turns"), [((0.027, 0.009), False), ((0.025, 0.0083), True)])
def test_a_pad_takes_over_what_another_cannot_hold(radii, turns):
    """Pads of 18 and 6 mm hold as much as two of 12 mm, though the least moments exceed one."""
    pads = {f"fingers.{i}.pad_radius": radius for i, radius in enumerate(radii)}
    run = simulate(with_values(soft_box(0.012, 1e-3, 0.3, "slides"), pads))
    moments = np.abs(run.trace.torsional_moment[-1])
    assert bool(run.phase_changes) == turns
    assert excess(run) < 1e-9
    if not turns:
        e = PAD_FACTORS["even"] * np.array(radii)
        least = 2.0 * HALF_WEIGHT * OFFSET * e**2 / (e**2).sum()
        assert moments[0] < least[0] - 0.01
        np.testing.assert_allclose(moments.sum(), 2.0 * HALF_WEIGHT * OFFSET, rtol=1e-6)


@pytest.mark.parametrize("law", ["composite", "certainty-equivalence", "pd-gravity", "grip-reflex"])
@pytest.mark.parametrize("n", [2, 3, 4])
def test_random_soft_grasps_end_with_a_true_outcome(n, law):
    rng = np.random.default_rng([n, len(law)])
    for _ in range(3):
        scenario = random_spatial_scenario(rng, n, "masses" if law != "composite" else "friction")
        values = {
            "controller.kind": law,
            "controller.distribution": "hold",
            "simulation.duration": 0.3,
        }
        values |= {
            f"fingers.{i}.pad_radius": float(rng.choice([0.0, rng.uniform(2e-3, 0.03)]))
            for i in range(n)
        }
        result = simulate(with_values(scenario, values))
        assert result.outcome is not Outcome.FAILED, result.reason
        if len(result.trace) > 2 and result.scenario.has_soft_fingers:
            assert excess(result) < 1e-9
        assert np.abs(result.trace.energy_residual).max() < 1e-6
        assert np.diff(result.trace.dissipated_energy).min() > -1e-9


def test_the_pressure_on_a_pad_decides_its_eccentricity():
    scenario = with_values(
        soft(load_scenario("spatial-composite"), 0.012), {"fingers.1.pad_pressure": "hertz"}
    )
    factors = [finger.eccentricity / 0.012 for finger in scenario.fingers]
    assert factors == pytest.approx([2.0 / 3.0, 3.0 * np.pi / 16.0, 2.0 / 3.0])
    # e = int r p dA / int p dA over the pad.
    r = (np.arange(100_000) + 0.5) / 100_000
    for name, pressure in (("even", np.ones_like(r)), ("hertz", np.sqrt(1.0 - r**2))):
        mean = (r * pressure * r).sum() / (pressure * r).sum()
        assert PAD_FACTORS[name] == pytest.approx(mean, rel=1e-4)
