"""Fingers that are chains: the closed forms written as chains, and a hand of a prototype."""

from dataclasses import replace

import numpy as np
import pytest

from slipgrasp import load_scenario, open_recording, simulate, verify, write_recording
from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario.loading import scenario_from_mapping, with_values
from slipgrasp.core.scenario.space import SPATIAL
from slipgrasp.core.scenario.spatial_geometry import spatial_joint_points, tip_at_start
from slipgrasp.core.scenario.unknowns import name_unknown
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.types import Outcome
from tests.core.reading_words import check_cause, check_headline
from tests.core.test_slides import gripper
from tests.references.spatial_scenarios import hand_of_scenario

pytestmark = pytest.mark.slow

PITCH = {"axis": (0.0, -1.0, 0.0), "centre": (0.5, 0.0, 0.0)}
ROD = (0.0, 0.0, 0.0, 1.0 / 12.0, 0.0, 1.0 / 12.0)
YAW_AND_PITCHES = [
    {"mass": 0.0},
    {**PITCH, "unit_inertia": ROD},
    {**PITCH, "unit_inertia": ROD, "place": (1.0, 0.0, 0.0)},
]


# The last joint in two, each of which turns by half of what is left of its angle.
SPLIT = 0.2
YAW_AND_SPLIT_PITCHES = [
    *YAW_AND_PITCHES[:2],
    {**PITCH, "mass": 0.0, "place": (1.0, 0.0, 0.0)},
    {**PITCH, "unit_inertia": ROD, "follows": 2, "offset": SPLIT},
]


def with_split_joints(scenario):
    """Fingers of four joints instead of three, of which the last follows the one before."""
    mapping = as_chains(scenario).to_mapping()
    for finger in mapping["fingers"]:
        yaw, pitch, bend = finger["posture"]
        finger["posture"] = (yaw, pitch, 0.5 * (bend - SPLIT))
        finger["joints"] = [dict(joint) for joint in YAW_AND_SPLIT_PITCHES]
    for estimate in mapping.get("estimates", ()):
        estimate["parameter"] = estimate["parameter"].replace("joints.2", "joints.3")
    return scenario_from_mapping(mapping)


def as_chains(scenario, **values):
    """The same hand, its fingers written as chains."""
    mapping = scenario.to_mapping()
    tips = [np.add(tip_at_start(scenario, i), f.base) for i, f in enumerate(scenario.fingers)]
    starts = hand_of_scenario(scenario).fingers.joint_positions(np.array(tips))
    for start, given in zip(starts, mapping["fingers"], strict=True):
        # Near where it starts, for Newton's method to do the rest.
        posture = tuple((start + 0.05).tolist())
        joints = [dict(joint) for joint in YAW_AND_PITCHES]
        given |= {"kind": "chain", "joints": joints, "tip": (1.0, 0.0, 0.0), "posture": posture}
    for estimate in mapping.get("estimates", ()):
        for link in (0, 1):
            old, new = f"link_masses.{link}", f"joints.{link + 1}.mass"
            estimate["parameter"] = estimate["parameter"].replace(old, new)
    return with_values(scenario_from_mapping(mapping), values)


def assert_alike(chain, closed, tolerance):
    """Two runs do the same, event by event."""
    assert chain.outcome is closed.outcome is Outcome.COMPLETED
    ours, theirs = ([(c.contact, c.to_phase) for c in run.phase_changes] for run in (chain, closed))
    assert ours == theirs
    times = [[change.time for change in run.phase_changes] for run in (chain, closed)]
    np.testing.assert_allclose(times[0], times[1], atol=tolerance)
    np.testing.assert_allclose(chain.metrics.slip_path, closed.metrics.slip_path, rtol=1e-7)
    np.testing.assert_allclose(chain.trace.estimates[-1], closed.trace.estimates[-1], rtol=1e-6)
    for name in ("joint_position", "joint_velocity", "joint_torque"):
        np.testing.assert_allclose(
            getattr(chain.trace, name)[-1], getattr(closed.trace, name)[-1], atol=1e-5
        )
    for name in ("kinetic_energy", "potential_energy", "supplied_energy"):
        values = getattr(closed.trace, name)
        np.testing.assert_allclose(getattr(chain.trace, name)[-1], values[-1], atol=1e-6)


@pytest.mark.parametrize("preset", ["spatial-prism", "spatial-composite"])
def test_the_closed_form_written_as_a_chain_gives_the_same_run(preset):
    closed = with_values(load_scenario(preset), {"simulation.duration": 0.5})
    chain = simulate(as_chains(closed))
    assert_alike(chain, simulate(closed), 1e-8)
    assert np.abs(chain.trace.energy_residual).max() < 2e-9


@pytest.mark.parametrize("preset", ["spatial-prism", "spatial-composite"])
def test_a_joint_written_as_two_that_turn_together_gives_the_same_run(preset):
    closed = with_values(load_scenario(preset), {"simulation.duration": 0.3})
    chain, single = simulate(with_split_joints(closed)), simulate(closed)
    trace = chain.trace
    bends = trace.joint_position[:, 2::3]
    np.testing.assert_allclose(2.0 * bends[-1] + SPLIT, single.trace.joint_position[-1, 2::3])
    both = {"joint_position": bends, "joint_velocity": trace.joint_velocity[:, 2::3]}
    parts = {name: getattr(trace, name).copy() for name in (*both, "joint_torque")}
    parts["joint_position"][:, 2::3] = 2.0 * bends + SPLIT
    parts["joint_velocity"][:, 2::3] *= 2.0
    parts["joint_torque"][:, 2::3] *= 0.5
    assert_alike(replace(chain, trace=replace(trace, **parts)), single, 1e-8)
    assert np.abs(trace.energy_residual).max() < 2e-9


def test_a_run_ends_where_a_joint_comes_to_the_end_of_its_range(tmp_path):
    scenario = as_chains(load_scenario("spatial-prism"), **{"simulation.duration": 0.5})
    free = simulate(scenario).trace
    row = int(np.searchsorted(free.times, 0.15))
    for joint, end in ((0, "maximum"), (1, "minimum"), (2, "minimum")):
        limit = float(free.joint_position[row, 3 + joint])
        key = f"fingers.1.joints.{joint}.{end}"
        run = simulate(with_values(scenario, {key: limit}))
        assert (run.outcome, run.reason.code, run.reason.contact) == ("singular", "joint_limit", 1)
        assert run.reason.limit == limit and abs(run.reason.value - limit) < 1e-9
        assert key in run.reason.message and abs(run.reason.time - free.times[row]) < 1e-7
        # Until then nothing is different.
        count = int((free.times < run.end_time - 1e-3).sum())
        np.testing.assert_array_equal(run.trace.joint_position[:count], free.joint_position[:count])
        verdict = describe_run(run)
        check_headline(run, verdict.headline)
        check_cause(run, verdict.sentences[0])
        write_recording(run, tmp_path / f"{joint}.mcap")
        assert verify(open_recording(tmp_path / f"{joint}.mcap")).same


def test_a_joint_gives_no_more_than_its_own_limit():
    scenario = as_chains(load_scenario("spatial-prism"), **{"simulation.duration": 0.15})
    keys = [f"fingers.{i}.joints.{k}.torque_limit" for i in range(3) for k in range(3)]
    weak = simulate(with_values(scenario, {"actuation.torque_limit": 16.0}))
    assert "torque_limited" in [warning.code for warning in weak.warnings]
    assert_same_bits(simulate(with_values(scenario, dict.fromkeys(keys, 16.0))), weak)
    # The limit of all joints replaces their own ones.
    both = dict.fromkeys(keys, 1.0) | {"actuation.torque_limit": 16.0}
    assert_same_bits(simulate(with_values(scenario, both)), weak)
    one = simulate(with_values(scenario, {keys[4]: 5.0}))
    assert np.abs(one.trace.joint_torque[:, 4]).max() <= 5.0
    assert np.abs(one.trace.joint_torque[:, 1]).max() > 5.0


def assert_same_bits(run, other):
    for name in ("times", "joint_position", "joint_torque", "object_pose", "normal_force"):
        ours, theirs = getattr(run.trace, name), getattr(other.trace, name)
        np.testing.assert_array_equal(ours, theirs)


SLIDING = [
    {"kind": "prismatic", "axis": axis, "mass": mass}
    for axis, mass in (((1.0, 0.0, 0.0), 0.0), ((0.0, 1.0, 0.0), 0.0), ((0.0, 0.0, 1.0), 0.2))
]


def jaws_as_chains(scenario):
    mapping = scenario.to_mapping()
    for i, finger in enumerate(mapping["fingers"]):
        finger |= {"kind": "chain", "joints": SLIDING, "tip": (1e-3, 0.0, 0.0)}
        finger["base"] = tuple(np.subtract(scenario.fingers[i].base, (1e-3, 0.0, 0.0)).tolist())
    return scenario_from_mapping(mapping)


def test_slides_written_as_a_chain_give_the_same_run():
    slides = gripper(SPATIAL, (0.02, 0.1, 0.3), grip_force=6.0)
    chain, closed = simulate(jaws_as_chains(slides)), simulate(slides)
    assert max(closed.metrics.slip_path) > 1e-3
    np.testing.assert_allclose(chain.metrics.slip_path, closed.metrics.slip_path, rtol=1e-7)
    for name in ("object_pose", "joint_position", "joint_torque", "kinetic_energy"):
        ours, theirs = (getattr(run.trace, name)[-1] for run in (chain, closed))
        np.testing.assert_allclose(ours, theirs, atol=1e-8)
    units = {column.name: column.unit for column in columns_of(chain.trace)}
    assert (units["joint_position_1_2"], units["torque_0_0"]) == ("m", "N")


# Facts of the TriFinger Pro of the Open Dynamic Robot Initiative, whose last link carries its tip.
LINKS = (
    (0.26689, (0.006, 0.122, 0.0), (1023.62, 8.89, -0.19, 64.5, 1.06, 1022.25)),
    (
        0.27163,
        (0.03935008, -0.00012438, -0.08666705),
        (940.6, -0.46, -34.79, 948.24, 1.64, 75.73),
    ),
    (0.05569, (0.016327, -0.00001095, -0.04284052), (136.26, 0.0, -6.62, 133.72, 0.04, 6.67)),
)
TIP_MASS, TIP_INERTIA, TIP = 0.031, 5.1667e-7, (0.019, 0.0, -0.16)
PLACES = ((0.0, 0.0, 0.0), (0.01685, 0.0505, 0.0), (0.05015, 0.0, -0.16))
AXES = ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0))
RANGES = ((-0.33, 1.0), (0.0, 1.57), (-2.7, 0.0))
UPPER = np.triu_indices(3)


def full(entries):
    xx, xy, xz, yy, yz, zz = entries
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def about(inertia, mass, offset):
    """Inertia about a point at an offset from the centre of mass."""
    offset = np.asarray(offset)
    return inertia + mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))


def trifinger_joints():
    joints = []
    for k, (mass, centre, entries) in enumerate(LINKS):
        inertia, centre = 1e-6 * full(entries), np.array(centre)
        if k == 2:
            both = (mass * centre + TIP_MASS * np.array(TIP)) / (mass + TIP_MASS)
            tip = about(TIP_INERTIA * np.eye(3), TIP_MASS, both - TIP)
            inertia = about(inertia, mass, both - centre) + tip
            mass, centre = mass + TIP_MASS, both
        unit = (inertia / mass)[UPPER]
        joints.append(
            {
                "place": PLACES[k],
                "axis": AXES[k],
                "mass": mass,
                "centre": tuple(centre.tolist()),
                "unit_inertia": tuple(unit.tolist()),
                "minimum": RANGES[k][0],
                "maximum": RANGES[k][1],
            }
        )
    return joints


def trifinger():
    radius, height, mass = 0.0325, 0.065, 0.094
    corners = np.radians([-30.0, 90.0, 210.0])
    across = mass * (3.0 * height**2 / 24.0 + height**2 / 12.0)
    fingers = []
    for i, face in enumerate(("side-0", "side-2", "side-1")):
        half = -0.5 * np.radians(120.0 * i)
        attitude = (float(np.cos(half)), 0.0, 0.0, float(np.sin(half)))
        fingers.append(
            {
                "kind": "chain",
                "joints": trifinger_joints(),
                "tip": TIP,
                "base": (0.0, 0.0, 0.29),
                "attitude": attitude,
                "posture": (0.2, 0.8, -1.7),
                "face": face,
                "friction": (0.5, 0.35, 0.6)[i],
            }
        )
    frictions = [
        {"parameter": f"fingers.{i}.friction", "initial": 1.2, "minimum": 0.05, "maximum": 2.0}
        for i in range(3)
    ]
    inertias = [
        {"parameter": f"object.inertias.{k}", "initial": 1e-4, "minimum": 1e-6, "maximum": 1e-2}
        for k in range(3)
    ]
    weight = {"parameter": "object.mass", "initial": 0.05, "minimum": 0.005, "maximum": 1.0}
    return scenario_from_mapping(
        {
            "object": {
                "mass": mass,
                "inertias": (across, across, mass * 3.0 * height**2 / 12.0),
                "height": height,
                "corners": [
                    (2.0 * radius * float(np.cos(a)), 2.0 * radius * float(np.sin(a)))
                    for a in corners
                ],
            },
            "fingers": fingers,
            "trajectory": {"start": (0.0, 0.0, 0.08, 1.0, 0.0, 0.0, 0.0)},
            "controller": {
                "kind": "composite",
                "control_period": 0.001,
                "lyapunov_weight": 20.0,
                "distribution": "hold",
                "grip_safety": 1.05,
                "minimum_normal_force": 0.05,
                "slip_stop": 1.0,
                "forgetting": 0.98,
                "force_noise": 0.01,
                "initial_deviation": (3.0, 3.0, 3.0, 0.3, 1e-3, 1e-3, 1e-3),
            },
            "estimates": [*frictions, weight, *inertias],
            "simulation": {"duration": 0.5},
        }
    )


def test_a_trifinger_does_what_it_did_in_a_prototype(tmp_path):
    scenario = trifinger()
    run = simulate(scenario)
    start = run.trace.joint_position[0].reshape(3, 3)
    np.testing.assert_allclose(start, [[0.2847, 0.7340, -1.8180]] * 3, atol=5e-5)
    for i, finger in enumerate(scenario.fingers):
        tip = spatial_joint_points(finger, start[i])[-1] - finger.base
        np.testing.assert_allclose(tip, tip_at_start(scenario, i), atol=1e-12)
    ends = {c.contact: c.time for c in run.phase_changes if c.to_phase == 0}
    assert [round(ends[i], 6) for i in range(3)] == [0.005924, 0.006584, 0.002637]
    paths = np.round(1e3 * np.array(run.metrics.slip_path), 4)
    np.testing.assert_array_equal(paths, [0.0263, 0.0307, 0.0097])
    # The largest force of the prototype is that at ticks; between them, where a slip ends, it is
    # larger.
    ticks = np.abs(run.trace.times * 1e3 % 1.0) < 1e-6
    assert round(run.trace.normal_force[ticks].max(), 3) == 0.935
    assert round(max(run.metrics.peak_normal_force), 3) == 0.950
    np.testing.assert_allclose(run.trace.estimates[-1][:4], [0.5, 0.35, 0.6, 0.094], rtol=1e-4)
    assert np.abs(run.trace.energy_residual).max() < 1e-11
    write_recording(run, tmp_path / "trifinger.mcap")
    assert verify(open_recording(tmp_path / "trifinger.mcap")).same


def joints_with(finger, k, **values):
    joints = [dict(joint) for joint in finger["joints"]]
    joints[k] |= values
    return joints


def test_an_unknown_of_a_chain_has_a_name_and_wrong_chains_are_refused():
    scenario = as_chains(load_scenario("spatial-prism"))
    assert name_unknown(scenario, "fingers.0.joints.2.mass").startswith("the mass of link 3 of the")
    mapping = scenario.to_mapping()
    finger = mapping["fingers"][0]
    for change, words in (
        ({"joints": finger["joints"][:2]}, "a chain needs 3"),
        ({"joints": [*finger["joints"], finger["joints"][0]]}, "--lock .* couple them to these"),
        ({"joints": joints_with(finger, 2, follows=2)}, "which is not an independent joint: 0, 1"),
        ({"joints": joints_with(finger, 1, minimum=1.0, maximum=0.5)}, "not below .*maximum, 0.5"),
        ({"joints": joints_with(finger, 2, maximum=-3.0)}, "joint 3 at .*, beyond .*2.maximum, -3"),
        ({"posture": (0.0, 0.0, 0.0)}, "cannot reach its contact from"),
        ({"attitude": (0.0, 0.0, 0.0, 0.0)}, "a quaternion of a rotation has length 1"),
        ({"base": (-5.0, 0.0, 0.0)}, "move the base, the start pose or the posture"),
    ):
        fingers = [finger | change, *mapping["fingers"][1:]]
        with pytest.raises(ScenarioError, match=words):
            scenario_from_mapping(mapping | {"fingers": fingers})
