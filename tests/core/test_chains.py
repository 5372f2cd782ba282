"""Fingers that are chains: the closed forms written as chains, and a hand of a prototype."""

from dataclasses import replace

import numpy as np
import pytest

from slipgrasp import load_scenario, open_recording, simulate, verify, write_recording
from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario.loading import scenario_from_mapping, with_values
from slipgrasp.core.scenario.space import HANDS, PLANAR, SPATIAL
from slipgrasp.core.scenario.spatial_geometry import spatial_joint_points, tip_at_start
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.types import Outcome
from tests.core.reading_words import check_cause, check_headline
from tests.core.test_planar_chains import as_chains as as_planar_chains
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


AS_CHAINS = {PLANAR: as_planar_chains, SPATIAL: as_chains}
CASES = {PLANAR: load_scenario("paper-case-1"), SPATIAL: load_scenario("spatial-prism")}
each_hand = pytest.mark.parametrize("space", HANDS)


@each_hand
def test_a_run_ends_where_a_joint_comes_to_the_end_of_its_range(space, tmp_path):
    values = {"simulation.duration": 2.0 if space is PLANAR else 0.5}
    scenario, count = AS_CHAINS[space](CASES[space], **values), space.joints_per_finger
    free = simulate(scenario).trace
    row = int(np.searchsorted(free.times, 1.5 if space is PLANAR else 0.15))
    moved = free.joint_position[:, count : 2 * count]
    for joint in range(count):
        rises = int(moved[row, joint] > moved[0, joint])
        limit, start = float(moved[row, joint]), float(moved[0, joint])
        ends = (start - 1.0, limit) if rises else (limit, start + 1.0)
        keys = [f"fingers.1.joints.{joint}.{end}" for end in ("minimum", "maximum")]
        run = simulate(with_values(scenario, dict(zip(keys, ends, strict=True))))
        assert (run.outcome, run.reason.code, run.reason.contact) == ("singular", "joint_limit", 1)
        assert run.reason.limit == limit and abs(run.reason.value - limit) < 1e-9
        assert keys[rises] in run.reason.message
        # It may have passed the limit before it came there to stay. Until then nothing differs
        # where control is sampled.
        first = int(np.argmax((moved[:, joint] - limit) * (2 * rises - 1) >= 0.0))
        assert free.times[first - 1] < run.reason.time <= free.times[first] + 1e-7
        before = int((free.times < run.end_time - 1e-3).sum()) * (space is SPATIAL)
        np.testing.assert_array_equal(
            run.trace.joint_position[:before], free.joint_position[:before]
        )
        verdict = describe_run(run)
        check_headline(run, verdict.headline)
        check_cause(run, verdict.sentences[0])
        write_recording(run, tmp_path / f"{joint}.mcap")
        assert verify(open_recording(tmp_path / f"{joint}.mcap")).same


@each_hand
def test_a_joint_gives_no_more_than_its_own_limit(space):
    sampled = {"controller.control_period": 0.001, "simulation.duration": 0.15}
    scenario, count = AS_CHAINS[space](CASES[space], **sampled), space.joints_per_finger
    fingers = range(len(scenario.fingers))
    keys = [f"fingers.{i}.joints.{k}.torque_limit" for i in fingers for k in range(count)]
    limit = 0.9 * float(np.abs(simulate(scenario).trace.joint_torque).max())
    weak = simulate(with_values(scenario, {"actuation.torque_limit": limit}))
    assert "torque_limited" in [warning.code for warning in weak.warnings]
    assert simulate(with_values(scenario, dict.fromkeys(keys, limit))).sha256 == weak.sha256
    # The limit of all joints replaces their own ones.
    both = dict.fromkeys(keys, 1.0) | {"actuation.torque_limit": limit}
    assert simulate(with_values(scenario, both)).sha256 == weak.sha256
    pitch = count - 2
    one = simulate(with_values(scenario, {keys[count + pitch]: 5.0}))
    assert np.abs(one.trace.joint_torque[:, count + pitch]).max() <= 5.0
    assert np.abs(one.trace.joint_torque[:, pitch]).max() > 5.0


def jaws_as_chains(scenario):
    """Slides as joints that slide along each axis; the last one has their mass."""
    mapping, axes = scenario.to_mapping(), scenario.space.joints_per_finger
    joints = [{"kind": "prismatic", "axis": axis, "mass": 0.0} for axis in np.eye(axes).tolist()]
    joints[-1]["mass"] = 0.2
    tip = (1e-3, *[0.0] * (axes - 1))
    for i, finger in enumerate(mapping["fingers"]):
        finger |= {"kind": "chain", "joints": joints, "tip": tip}
        finger["base"] = tuple(np.subtract(scenario.fingers[i].base, tip).tolist())
    return scenario_from_mapping(mapping)


@each_hand
def test_slides_written_as_a_chain_give_the_same_run(space):
    slides = gripper(space, (0.02, 0.1, 0.3), grip_force=6.0)
    chain, closed = simulate(jaws_as_chains(slides)), simulate(slides)
    assert max(closed.metrics.slip_path) > 1e-3
    error = 1e-9 if space is PLANAR else 1e-8
    np.testing.assert_allclose(chain.metrics.slip_path, closed.metrics.slip_path, rtol=10.0 * error)
    for name in ("object_pose", "joint_position", "joint_torque", "kinetic_energy"):
        ours, theirs = (getattr(run.trace, name)[-1] for run in (chain, closed))
        np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=error)
    assert np.ptp(chain.trace.potential_energy - closed.trace.potential_energy) < 1e-12
    units = {column.name: column.unit for column in columns_of(chain.trace)}
    assert (units["joint_position_1_1"], units["torque_0_0"]) == ("m", "N")


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


WRONG = {
    PLANAR: [
        (lambda f: {"joints": f["joints"][:1]}, "a chain needs 2"),
        (lambda f: {"joints": joints_with(f, 1, minimum=1.0)}, "have to be given, less than one"),
        (lambda f: {"joints": joints_with(f, 1, minimum=-4.0, maximum=4.0)}, "one turn apart"),
        (lambda f: {"joints": joints_with(f, 1, minimum=0.0, maximum=1.0)}, "joint 2 at .*, beyon"),
        (lambda f: {"joints": joints_with(f, 1, kind="prismatic", axis=(0.0, 0.0))}, "length 0"),
        (lambda f: {"joints": joints_with(f, 1, torque_limit=9.0)}, "torque_limit .*sampled contr"),
        (lambda _: {"tip": (0.0, 0.0)}, "cannot reach its contact, or is singular"),
        (lambda _: {"base": (-9.0, 0.0)}, "cannot reach its contact, or is singular"),
    ],
    SPATIAL: [
        (lambda f: {"joints": f["joints"][:2]}, "a chain needs 3"),
        (lambda f: {"joints": [*f["joints"], f["joints"][0]]}, "--lock .* couple them to these"),
        (lambda f: {"joints": joints_with(f, 2, follows=2)}, "not an independent joint: 0, 1"),
        (lambda f: {"joints": joints_with(f, 1, minimum=1.0, maximum=0.5)}, "not below .*mum, 0.5"),
        (lambda f: {"joints": joints_with(f, 2, maximum=-3.0)}, "joint 3 at .*, beyond .*imum, -3"),
        (lambda _: {"posture": (0.0, 0.0, 0.0)}, "cannot reach its contact from"),
        (lambda _: {"attitude": (0.0, 0.0, 0.0, 0.0)}, "quaternion of a rotation has length 1"),
        (lambda _: {"base": (-5.0, 0.0, 0.0)}, "move the base, the start pose or the posture"),
    ],
}


@each_hand
def test_wrong_chains_are_refused(space):
    mapping = AS_CHAINS[space](CASES[space]).to_mapping()
    finger = mapping["fingers"][0]
    for changed, words in WRONG[space]:
        fingers = [finger | changed(finger), *mapping["fingers"][1:]]
        with pytest.raises(ScenarioError, match=words):
            scenario_from_mapping(mapping | {"fingers": fingers})
