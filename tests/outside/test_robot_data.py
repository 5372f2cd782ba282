"""Fingers of the hands in example-robot-data, each of which Pinocchio reads from the same file."""

from importlib import metadata

import numpy as np
import pinocchio
import pytest
from scipy.spatial.transform import Rotation

from slipgrasp import simulate
from slipgrasp.cli.main import main
from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario.chain import chain_points
from slipgrasp.core.scenario.hand_files.description import (
    AT_ORIGIN,
    Description,
    Follows,
    finger_mapping,
)
from slipgrasp.core.scenario.hand_files.urdf import read_urdf
from slipgrasp.core.scenario.hand_files.visuals import meshes_of, read_urdf_visuals
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.trace.types import Outcome
from tests.drawn_meshes import assert_same_points, drawn_vertices
from tests.outside.test_pinocchio_chains import assert_same, by_kernel, by_pinocchio

EDU = "finger_edu.urdf", "finger_tip_link"
ALLEGRO = "allegro_right_hand.urdf"
# The four joints of each of its fingers, from the palm on, and the tip.
FINGERS = [(range(k, k + 4), f"link_{k + 3}.0_tip") for k in (0, 4, 8, 12)]


def file_of(name):
    try:
        files = metadata.files("example-robot-data") or ()
    except metadata.PackageNotFoundError:
        pytest.skip("example-robot-data is not installed")
    return next(file.locate() for file in files if file.name == name)


def model_of(text, kept, positions):
    """Of all joints of a file only some, in the order of the file; the others stand somewhere."""
    model = pinocchio.buildModelFromXML(text)
    q = pinocchio.neutral(model)
    for name, position in positions.items():
        q[model.joints[model.getJointId(name)].idx_q] = position
    locked = [k for k, name in enumerate(model.names) if k > 0 and name not in kept]
    return pinocchio.buildReducedModel(model, locked, q)


def assert_alike(text, tip, names, locked, coupled, coupling, seed):
    rng = np.random.default_rng(seed)
    q, rates = rng.uniform(-0.5, 0.5, 3), rng.normal(size=3)
    read = Description(*read_urdf(text), locked, coupled).finger(tip)
    _, ours = by_kernel(read, q, rates)
    model = model_of(text, [name for name in names if name not in locked], locked)
    _, theirs = by_pinocchio(model, tip, coupling, q, rates)
    assert_same(ours, theirs)
    return read


def test_finger_edu_moves_as_in_pinocchio():
    name, tip = EDU
    text = file_of(name).read_text()
    names = [n for n in pinocchio.buildModelFromXML(text).names if n != "universe"]
    read = assert_alike(text, tip, names, {}, {}, (np.eye(3), np.zeros(3)), 1)
    assert all(joint.minimum < 0.0 < joint.maximum for joint in read.joints)


@pytest.mark.parametrize("place", range(4))
@pytest.mark.parametrize("finger", range(4))
def test_a_finger_of_allegro_with_one_joint_locked_moves_as_in_pinocchio(finger, place):
    joints, tip = FINGERS[finger]
    names = [f"joint_{k}.0" for k in joints]
    locked = {names[place]: 0.4}
    text = file_of(ALLEGRO).read_text()
    read = assert_alike(text, tip, names, locked, {}, (np.eye(3), np.zeros(3)), place)
    assert len(read.joints) == 3 and all(joint.torque_limit == 15.0 for joint in read.joints)


@pytest.mark.parametrize("finger", range(4))
def test_a_finger_of_allegro_whose_last_joints_are_coupled_moves_as_in_pinocchio(finger):
    joints, tip = FINGERS[finger]
    names = [f"joint_{k}.0" for k in joints]
    ratios = np.vstack([np.eye(3), [0.0, 0.0, 0.8]])
    coupled = {names[3]: Follows(names[2], 0.8, 0.1)}
    coupling = ratios, np.array([0.0, 0.0, 0.0, 0.1])
    text = file_of(ALLEGRO).read_text()
    read = assert_alike(text, tip, names, {}, coupled, coupling, finger)
    assert [joint.follows for joint in read.joints] == [None, None, None, 2]


def test_all_four_joints_of_a_finger_of_allegro_are_too_many():
    with pytest.raises(ScenarioError, match=r"lock others with --lock .*, or couple them"):
        Description(*read_urdf(file_of(ALLEGRO).read_text())).finger(FINGERS[0][1])


def vertices_in_pinocchio(file, positions, left_out):
    """All vertices of the visual meshes except those of some links, which it reads by itself."""
    packages = [str(folder) for folder in file.parents]
    model = pinocchio.buildModelFromUrdf(str(file))
    kind = pinocchio.GeometryType.VISUAL
    shapes = pinocchio.buildGeomFromUrdf(model, str(file), kind, package_dirs=packages)
    q = pinocchio.neutral(model)
    for name, position in positions.items():
        q[model.joints[model.getJointId(name)].idx_q] = position
    data, placed = model.createData(), shapes.createData()
    pinocchio.updateGeometryPlacements(model, data, shapes, placed, q)
    found = []
    for each, pose in zip(shapes.geometryObjects, placed.oMg, strict=True):
        if model.frames[each.parentFrame].name not in left_out:
            found.append(each.geometry.vertices() @ pose.rotation.T + pose.translation)
    return np.concatenate(found)


def assert_drawn_alike(file, hand, fingers, names, coupling=None, left_out=()):
    """Meshes at random positions, against Pinocchio; each row of names is of one finger."""
    positions = np.random.default_rng(5).uniform(-0.6, 0.6, (len(fingers), 3))
    meshes = meshes_of(hand, fingers, read_urdf_visuals(file.read_text(), file.parent))
    named = dict(zip(np.ravel(names).tolist(), positions.ravel(), strict=True))
    for follower, leader in (coupling or {}).items():
        named[follower] = named[leader]
    ours = drawn_vertices(fingers, meshes, positions)
    assert_same_points(ours, vertices_in_pinocchio(file, named, left_out))


def test_the_meshes_of_finger_edu_move_as_in_pinocchio():
    name, tip = EDU
    file = file_of(name)
    hand = Description(*read_urdf(file.read_text()))
    names = [n for n in pinocchio.buildModelFromUrdf(str(file)).names if n != "universe"]
    assert_drawn_alike(file, hand, [hand.finger(tip)], [names])


def test_the_meshes_of_allegro_with_coupled_joints_move_as_in_pinocchio():
    """The base and three fingers; what belongs to the fourth one is not drawn."""
    file, chosen = file_of(ALLEGRO), (0, 8, 12)
    coupling = {f"joint_{k + 3}.0": f"joint_{k + 2}.0" for k in chosen}
    couples = {name: Follows(leader, 1.0, 0.0) for name, leader in coupling.items()}
    hand = Description(*read_urdf(file.read_text()), {}, couples)
    fingers = [hand.finger(f"link_{k + 3}.0_tip") for k in chosen]
    names = [[f"joint_{k + j}.0" for j in range(3)] for k in chosen]
    left_out = [f"link_{k}.0" for k in range(4, 8)] + ["link_7.0_tip"]
    assert_drawn_alike(file, hand, fingers, names, coupling, left_out)


def test_allegro_with_locked_joints_draws_them_where_they_are_locked():
    file = file_of(ALLEGRO)
    locked = {"joint_0.0": 0.3} | {f"joint_{k}.0": 0.2 for k in range(4, 16)}
    hand = Description(*read_urdf(file.read_text()), locked)
    fingers = [hand.finger("link_3.0_tip")]
    meshes = meshes_of(hand, fingers, read_urdf_visuals(file.read_text(), file.parent))
    named = locked | {f"joint_{k}.0": q for k, q in ((1, 0.1), (2, 0.4), (3, 0.5))}
    ours = drawn_vertices(fingers, meshes, np.array([[0.1, 0.4, 0.5]]))
    assert_same_points(ours, vertices_in_pinocchio(file, named, ()))


TRAY = """
hand = "hand.toml"

[object]
mass = 0.1
height = 0.05
half_width = 0.08
half_depth = 0.08
inertias = [2.4e-4, 2.4e-4, 4.3e-4]

[trajectory]
start = [0.0, 0.0, 0.025, 1.0, 0.0, 0.0, 0.0]
acceleration = [0.0256, 0.0, 0.0, 0.0, 0.0, 0.0]

[simulation]
duration = 3.0

[controller]
kind = "composite"
control_period = 0.001
lyapunov_weight = 20.0
distribution = "hold"
grip_safety = 1.05
minimum_normal_force = 0.05
slip_stop = 1.0
"""


def tray(folder):
    """A box that lies on two fingertips and the thumb of Allegro, and is carried along x.

    The hand is turned so that these are level where joints are in the middle of their ranges.
    """
    file, tips = file_of(ALLEGRO), [FINGERS[k][1] for k in (0, 2, 3)]
    couples = {f"joint_{k + 3}.0": Follows(f"joint_{k + 2}.0", 1.0, 0.0) for k in (0, 8, 12)}
    hand = Description(*read_urdf(file.read_text()), {}, couples)
    ends = np.array([middle_of(hand.finger(tip)) for tip in tips])
    normal = np.cross(ends[1] - ends[0], ends[2] - ends[0])
    turn, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [normal / np.linalg.norm(normal)])
    level = turn.apply(ends)
    pose = [*(-level.mean(axis=0)).tolist(), *turn.as_euler("xyz").tolist()]
    given = [f"--couple={name}={each.leader},1" for name, each in couples.items()]
    command = ["hands", "import", str(file), "--output", str(folder / "hand.toml"), *given]
    assert main([*command, "--tips", *tips, "--base-pose", *map(repr, pose)]) == 0
    fingers = "".join(
        f'[[fingers]]\nface = "bottom"\nbase = [0, 0, 0]\ncontact_offset = [{x!r}, {y!r}]\n'
        for x, y, _ in (level - level.mean(axis=0)).tolist()
    )
    (folder / "tray.toml").write_text(TRAY + fingers)
    return load_scenario(folder / "tray.toml")


def middle_of(finger):
    """Where a fingertip is with the joints in the middle of their ranges, from the base."""
    given = finger_mapping(finger, AT_ORIGIN)
    points, _ = chain_points(given["attitude"], finger.joints, finger.tip, given["posture"])
    return points[-1]


def test_allegro_carries_a_box_until_a_joint_comes_to_its_limit(tmp_path, capsys):
    scenario = tray(tmp_path)
    said = capsys.readouterr().out
    assert "omitted, since they belong to no finger: link_4.0" in said
    assert "meshes: hand.meshes.npz, 21854 triangles" in said
    run = simulate(scenario)
    assert run.metrics.slip_path == (0.0, 0.0, 0.0)
    assert np.abs(run.trace.energy_residual).max() < 1e-9
    assert run.outcome is Outcome.SINGULAR and run.reason.code == "joint_limit"
    assert "fingers.2.joints.1.maximum" in run.reason.message
    assert run.reason.limit == 1.163 and abs(run.reason.value - 1.163) < 1e-9
    assert run.trace.joint_position[-1, 7] == pytest.approx(1.163, abs=1e-9)
