"""Fingers on slides and the law of a gripper: closed forms, for planar and spatial hands alike."""

import numpy as np
import pytest

from slipgrasp import (
    Simulation,
    load_scenario,
    register_law,
    simulate,
    with_law,
    with_values,
)
from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario.custom_laws import forget
from slipgrasp.core.scenario.loading import scenario_from_mapping
from slipgrasp.core.scenario.space import HANDS, PLANAR, SPATIAL
from slipgrasp.core.scenario.unknowns import name_unknown
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.types import Outcome

pytestmark = pytest.mark.slow

MASS, JAW, FRICTION, GRAVITY, HEIGHT = 0.4, 0.2, 0.35, 9.81, 0.1
LEAST_FORCE = MASS * GRAVITY / (2.0 * FRICTION)
JAWS = {"kind": "slides", "mass": JAW, "friction": FRICTION}
GRIPPER = {
    "kind": "gripper",
    "grip_force": 1.05 * LEAST_FORCE,
    "jaw_stiffness": 2000.0,
    "jaw_damping": 60.0,
    "force_rate": 1e6,
}


def gripper(space, motion=(0.0, 0.0, 0.0), mass=MASS, **controller):
    """Two jaws at a box whose middle they hold; it moves by (x, height, angle) in half a second."""
    x, height, angle = motion
    bases = (0.01, 0.25), (-0.02, 0.2)
    if space is PLANAR:
        faces, start, pose = ("left", "right"), (0.0, HEIGHT, 0.0), (x, HEIGHT + height, angle)
        body = {"mass": mass, "inertia": 1e-3, "half_width": 0.05, "face_half_length": 0.06}
    else:
        # The angle of the plane counts about -y of space.
        faces, start = ("side-3", "side-1"), (0.0, 0.0, HEIGHT, 1.0, 0.0, 0.0, 0.0)
        pose = (x, 0.0, HEIGHT + height, 0.0, -angle, 0.0)
        body = {"mass": mass, "inertias": (1e-3, 1e-3, 1e-3), "half_width": 0.05, "height": 0.12}
        bases = [(x, 0.0, z) for x, z in bases]
    fingers = [
        {**JAWS, "base": base, "face": face} for base, face in zip(bases, faces, strict=True)
    ]
    move = {"time": 0.2, "duration": 0.5, "pose": pose}
    return scenario_from_mapping(
        {
            "object": body,
            "fingers": fingers,
            "trajectory": {"kind": "set-points", "start": start, "set_points": [move]},
            "controller": {**GRIPPER, **controller},
            "simulation": {"duration": 1.0, "relative_tolerance": 1e-9},
        }
    )


def joints_of(result):
    """Positions of the slides, shape (rows, fingers, axes)."""
    return result.trace.joint_position.reshape(len(result.trace), 2, -1)


def pushed(scenario, forces):
    """A run under constant forces of the jaws, shape (fingers, axes)."""
    simulation = Simulation(scenario)
    for tick in simulation.ticks():
        tick.torque = forces
    return simulation.result()


@pytest.mark.parametrize("space", HANDS)
def test_jaws_that_are_pushed_carry_their_object_along_a_parabola(space):
    scenario = with_values(gripper(space), {"simulation.duration": 0.3})
    axes = space.joints_per_finger
    forces = np.zeros((2, axes))
    forces[:, 0] = 30.2, -30.0
    forces[:, -1] = (0.5 * MASS + JAW) * GRAVITY + 0.1
    run = pushed(scenario, forces)
    t, total = run.trace.times, MASS + 2.0 * JAW
    expected = 0.5 * (0.2 / total) * t**2
    assert run.outcome is Outcome.COMPLETED
    np.testing.assert_allclose(run.trace.object_pose[:, 0], expected, atol=1e-12)
    joints = joints_of(run)
    np.testing.assert_allclose(joints[:, :, 0] - joints[0, :, 0], np.stack([expected] * 2, 1))
    np.testing.assert_allclose(joints[:, 0, -1], HEIGHT - 0.25 + expected, atol=1e-12)
    velocity = run.trace.joint_velocity.reshape(len(t), 2, axes)
    np.testing.assert_allclose(velocity[:, :, 0], np.stack([0.2 / total * t] * 2, 1), atol=1e-12)
    lost = JAW * 0.2 / total
    np.testing.assert_allclose(run.trace.normal_force[:, 0], 30.2 - lost, rtol=1e-12)
    assert np.abs(run.trace.energy_residual).max() < 1e-12


@pytest.mark.parametrize("space", HANDS)
def test_a_box_that_is_held_too_lightly_slides_down_and_drags_its_jaws(space):
    heavy, force = 20.0, 0.8 * LEAST_FORCE
    values = {f"fingers.{i}.mass": heavy for i in range(2)}
    scenario = with_values(gripper(space), {**values, "simulation.duration": 0.1})
    forces = np.zeros((2, space.joints_per_finger))
    forces[:, 0] = force, -force
    forces[:, -1] = heavy * GRAVITY
    run = pushed(scenario, forces)
    t, dragged = run.trace.times, 0.5 * FRICTION * force / heavy
    fallen = (0.5 * GRAVITY - FRICTION * force / MASS) * t**2
    height = run.trace.object_pose[:, space.num_positions - 1]
    np.testing.assert_allclose(height, HEIGHT - fallen, atol=1e-9)
    jaws = joints_of(run)[:, 0, -1]
    np.testing.assert_allclose(jaws, jaws[0] - dragged * t**2, atol=1e-9)
    slid = fallen[-1] - dragged * t[-1] ** 2
    assert run.metrics.slip_path == pytest.approx([slid] * 2, rel=1e-6)
    assert np.abs(run.trace.energy_residual).max() < 1e-9


@pytest.mark.parametrize("space", HANDS)
def test_two_jaws_hold_a_box_from_half_its_weight_over_friction_on(space):
    for share, holds in ((1.002, True), (0.998, False)):
        # So soft that what brakes the sagging box, m K / (2 D^2) of its weight, is below 0.1 %.
        soft = {"jaw_stiffness": 100.0, "jaw_damping": 150.0}
        run = simulate(gripper(space, grip_force=share * LEAST_FORCE, **soft))
        assert (max(run.metrics.slip_path) == 0.0) is holds


@pytest.mark.parametrize("space", HANDS)
def test_the_closing_force_follows_as_a_lag_no_faster_than_its_rate(space):
    change = {"time": 0.1, "parameter": "controller.grip_force", "value": 30.0}
    mapping = gripper(space, grip_force=20.0, force_bandwidth=5.0).to_mapping()
    scenario = scenario_from_mapping(mapping | {"changes": [change]})
    run = simulate(scenario)
    since = np.array([0.05, 0.15, 0.4])
    at = np.searchsorted(run.trace.times, 0.101 + since, side="right") - 1
    lag = 30.0 - 10.0 * np.exp(-2.0 * np.pi * 5.0 * since)
    np.testing.assert_allclose(run.trace.normal_force[at, 0], lag, rtol=1e-9)

    slow = simulate(with_values(scenario, {"controller.force_rate": 25.0}))
    at = np.searchsorted(slow.trace.times, 0.201, side="right") - 1
    np.testing.assert_allclose(slow.trace.normal_force[at, 0], 20.0 + 2.5, rtol=1e-9)
    with pytest.raises(ScenarioError, match=r"more than controller\.maximum_normal_force, 24 N"):
        with_values(scenario, {"controller.maximum_normal_force": 24.0})


@pytest.mark.parametrize("space", HANDS)
def test_a_gripper_follows_the_arm_that_carries_it_and_its_ledger_closes(space):
    run = simulate(gripper(space, (0.05, 0.1, 0.2), grip_force=20.0))
    assert run.metrics.held
    sag = MASS * GRAVITY / (2.0 * GRIPPER["jaw_stiffness"])
    error = run.trace.tracking_error[-1]
    assert error[space.num_positions - 1] == pytest.approx(sag, rel=0.02)
    assert np.abs(error[0]) < 1e-5
    assert np.abs(run.trace.energy_residual).max() < 1e-9


def test_a_planar_gripper_does_what_a_spatial_one_does_in_a_plane():
    # It rolls about y, across the line between its jaws, and slips while it speeds up.
    motion = (0.02, 0.1, 0.3)
    planar, spatial = (simulate(gripper(space, motion)) for space in HANDS)
    assert max(planar.metrics.slip_path) > 1e-4
    np.testing.assert_allclose(planar.metrics.slip_path, spatial.metrics.slip_path, rtol=1e-6)
    times, index = np.unique(planar.trace.times, return_index=True)
    _, other = np.unique(spatial.trace.times, return_index=True)
    common = np.arange(0.0, 1.0, 0.01)
    for ours, theirs, atol in (
        (planar.trace.object_pose[:, :2], spatial.trace.object_pose[:, [0, 2]], 1e-8),
        (planar.trace.normal_force, spatial.trace.normal_force, 1e-4),
        (joints_of(planar)[:, 1], joints_of(spatial)[:, 1, [0, 2]], 1e-8),
    ):
        for k in range(2):
            np.testing.assert_allclose(
                np.interp(common, times, ours[index, k]),
                np.interp(common, spatial.trace.times[other], theirs[other, k]),
                atol=atol,
            )


@pytest.mark.parametrize("space", HANDS)
def test_an_unknown_mass_on_slides_is_learnt(space):
    mapping = with_law(gripper(space, (0.0, 0.05, 0.0)), "composite").to_mapping()
    estimates = [{"parameter": f"fingers.{i}.mass", "initial": 0.4} for i in range(2)]
    run = simulate(scenario_from_mapping(mapping | {"estimates": estimates}))
    assert run.outcome is Outcome.COMPLETED
    np.testing.assert_allclose(run.trace.estimates[-1].sum(), 2.0 * JAW, rtol=2e-3)
    assert name_unknown(run.scenario, "fingers.0.mass").startswith("the moving mass of the ")


@pytest.mark.parametrize("law", ["theorem-3", "pd-gravity", "grip-reflex", "composite"])
@pytest.mark.parametrize("space", HANDS)
def test_every_law_holds_with_jaws_that_it_knows(space, law):
    scenario = with_values(gripper(space, (0.02, 0.05, 0.1)), {"controller.grip_force": 30.0})
    run = simulate(with_law(scenario, law))
    assert run.metrics.held
    assert np.abs(run.trace.energy_residual).max() < 1e-8


@pytest.mark.parametrize("space", HANDS)
def test_a_hand_may_have_one_finger_of_links_and_one_on_slides(space):
    mapping = gripper(space, (0.0, 0.05, 0.0), grip_force=20.0).to_mapping()
    base = (1.4, 0.0) if space is PLANAR else (1.4, 0.0, 0.0)
    jaw, finger = mapping["fingers"]
    jaw |= {"joint_damping": 0.5, "joint_friction": 0.2}
    finger |= {"kind": "links", "base": base, "joint_damping": 0.1}
    run = simulate(scenario_from_mapping(mapping))
    assert run.metrics.held
    assert np.abs(run.trace.energy_residual).max() < 1e-8
    units = {column.name: column.unit for column in columns_of(run.trace)}
    assert [units[f"joint_position_{i}_0"] for i in range(2)] == ["m", "rad"]
    assert [units[f"joint_velocity_{i}_1"] for i in range(2)] == ["m/s", "rad/s"]
    assert [units[f"torque_{i}_1"] for i in range(2)] == ["N", "N m"]
    assert [units[f"commanded_torque_{i}_1"] for i in range(2)] == ["N", "N m"]


@pytest.mark.parametrize("space", HANDS)
def test_an_added_mass_on_slides_is_a_work_in_the_ledger(space):
    change = {"time": 0.45, "parameter": "fingers.0.mass", "value": 0.3}
    mapping = gripper(space, (0.0, 0.05, 0.0), grip_force=20.0).to_mapping()
    run = simulate(scenario_from_mapping(mapping | {"changes": [change]}))
    assert run.metrics.held
    assert np.abs(run.trace.energy_residual).max() < 1e-9


class Jaws:
    """Presses with 20 N and carries what it is shown to move."""

    name = "jaws"

    def command(self, seen, memory, out):
        model = seen.model
        assert not model.link_lengths.any() and not model.link_masses[:, 1].any()
        np.testing.assert_array_equal(seen.jacobian, seen.jacobian_inverse)
        forces = 20.0 * seen.contact_normal
        carried = model.link_masses[:, 0] + 0.5 * model.object_mass
        forces[:, -1] += model.gravity * carried
        out.torque[:] = np.einsum("nji,nj->ni", seen.jacobian, forces)


@pytest.mark.parametrize("space", HANDS)
def test_a_custom_law_drives_slides_with_forces(space):
    register_law(Jaws)
    try:
        run = simulate(with_values(gripper(space), {"controller.kind": "jaws"}))
    finally:
        forget("jaws")
    assert run.metrics.held
    np.testing.assert_allclose(run.trace.normal_force, 20.0, rtol=1e-9)
    np.testing.assert_allclose(run.trace.object_pose[-1], run.trace.object_pose[0], atol=1e-9)


@pytest.mark.parametrize("space", HANDS)
def test_what_cannot_be_of_slides_is_refused(space):
    scenario = gripper(space)
    with pytest.raises(ScenarioError, match=r"fingers\.N\.friction and fingers\.N\.mass can"):
        estimates = [{"parameter": "fingers.0.link_masses.0", "initial": 1.0}]
        scenario_from_mapping(scenario.to_mapping() | {"estimates": estimates})
    with pytest.raises(ScenarioError, match=r"fingers\.0\.mass"):
        with_values(scenario, {"fingers.0.mass": 0.0})
    with pytest.raises(ScenarioError, match="cannot reach its contact"):
        with_values(scenario, {"fingers.0.kind": "links", "fingers.0.base.0": 9.0})
    far = with_values(scenario, {"fingers.0.base.0": 9.0})
    assert far.fingers[0].base[0] == 9.0
    with pytest.raises(ScenarioError, match="control_period"):
        with_values(scenario, {"controller.control_period": 0.0})


def test_a_spatial_grasp_of_two_jaws_can_turn_about_the_line_between_them():
    run = simulate(gripper(SPATIAL))
    assert any(warning.code == "free_rotation" for warning in run.warnings)


def turned(result):
    """Angle of the last attitude about x [rad]."""
    w, x = result.trace.object_pose[-1, 3:5]
    return abs(2.0 * np.arctan2(x, w))


def test_a_box_turns_between_the_pads_of_a_gripper_as_in_a_prototype():
    # The prototype carried half of the weight with each jaw; this gripper lets it sag by 0.5 mm.
    run = simulate(load_scenario("parallel-gripper"))
    assert turned(run) == pytest.approx(0.7338, rel=3e-3)
    assert run.metrics.slip_path == pytest.approx([4.1322e-3] * 2, rel=3e-3)
    along, across = np.abs(run.trace.slip[-1].reshape(2, 2)).T
    assert along == pytest.approx([3.769e-3] * 2, rel=4e-3)
    assert across == pytest.approx([1.457e-3] * 2, rel=5e-3)
    assert run.trace.dissipated_energy[-1] == pytest.approx(0.16843, rel=3e-3)
    assert np.abs(run.trace.energy_residual).max() < 1e-9
    # Statics: it turns below 21.9 N; above, it slips a little while it sags.
    firm = simulate(with_values(run.scenario, {"controller.grip_force": 23.0}))
    assert turned(firm) < 5e-3


def padded_lift(force, begin):
    """A lift by pads of which neither line nor height goes through the centre of mass."""
    sizes = np.array([0.1, 0.06, 0.12])
    inertias = MASS / 12.0 * (np.sum(sizes**2) - sizes**2)
    jaws = [
        {**JAWS, "mass": 0.1, "base": (0.0, 0.0, 0.25), "pad_radius": 0.009, "face": face}
        | {"contact_offset": (0.01, beside)}
        for face, beside in (("side-3", -0.015), ("side-1", 0.015))
    ]
    move = {"time": begin, "duration": 0.5, "pose": (0.0, 0.0, 0.16, 0.0, 0.0, 0.0)}
    start = (0.0, 0.0, 0.06, 1.0, 0.0, 0.0, 0.0)
    return scenario_from_mapping(
        {
            "object": {
                "mass": MASS,
                "inertias": tuple(inertias.tolist()),
                "half_width": 0.05,
                "half_depth": 0.03,
                "height": 0.12,
            },
            "fingers": jaws,
            "trajectory": {"kind": "set-points", "start": start, "set_points": [move]},
            "controller": {
                "kind": "gripper",
                "grip_force": force,
                "jaw_stiffness": 1e5,
                "jaw_damping": 200.0,
            },
            "simulation": {"duration": begin + 0.7},
        }
    )


def test_a_lift_with_pads_turns_as_in_a_second_program_and_holds_from_its_least_force_on():
    run = simulate(padded_lift(12.0, 0.0))
    assert run.metrics.last_slip_time == pytest.approx(0.3117, abs=2e-3)
    assert turned(run) == pytest.approx(0.8026, rel=3e-3)
    assert run.metrics.slip_path == pytest.approx([3.076e-3] * 2, rel=5e-3)
    # Before the lift the box sags; then the least force is 18.648 N.
    weak, firm = (simulate(padded_lift(force, 0.3)) for force in (18.4, 18.9))
    assert turned(weak) > 1e-4 > 1e-5 > turned(firm)
