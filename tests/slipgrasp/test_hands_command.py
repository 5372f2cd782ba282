"""``slipgrasp hands import``: a TriFinger from its URDF is the one written by hand."""

import tomllib

import numpy as np
import pytest
import trimesh
from mcap.reader import make_reader

from slipgrasp import simulate
from slipgrasp.cli.main import main
from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario.chain import chain_positions
from slipgrasp.core.scenario.hand_files.meshes import load_meshes
from slipgrasp.core.scenario.loading import (
    load_scenario,
    scenario_from_mapping,
    scenario_to_toml,
    with_values,
)
from slipgrasp.core.scenario.spatial_geometry import first_seeds, tip_at_start
from slipgrasp.recordings.file.reader import read_recording
from slipgrasp.recordings.file.writer import write_recording
from tests.core.test_chains import (
    AXES,
    LINKS,
    PLACES,
    RANGES,
    TIP,
    TIP_INERTIA,
    TIP_MASS,
    trifinger,
)

NAMES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def xyz(vector):
    return " ".join(f"{x!r}" for x in map(float, vector))


def link(name, mass, centre, entries):
    inertia = " ".join(f'{k}="{v!r}"' for k, v in zip(NAMES, map(float, entries), strict=True))
    return (
        f'<link name="{name}"><inertial><origin xyz="{xyz(centre)}"/><mass value="{mass!r}"/>'
        f"<inertia {inertia}/></inertial></link>"
    )


def joint(name, kind, parent, child, place, axis=(1, 0, 0), yaw=0.0, limits=(0.0, 0.0), more=""):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz(place)}" rpy="0 0 {float(yaw)!r}"/><axis xyz="{xyz(axis)}"/>'
        f'<limit lower="{limits[0]}" upper="{limits[1]}" effort="0.36" velocity="1"/>{more}</joint>'
    )


def urdf(more=""):
    """A holder with three fingers, each with its own mount, and a tip fixed to its last link."""
    parts = ['<link name="holder"/>', link("camera", 0.1, (0, 0, 0), (1, 0, 0, 1, 0, 1))]
    parts.append(joint("eye", "fixed", "holder", "camera", (0, 0, 0.1)))
    for i in range(3):
        parts.append(f'<link name="mount_{i}"/>')
        yaw = -np.radians(120.0 * i)
        parts.append(joint(f"m_{i}", "fixed", "holder", f"mount_{i}", (0, 0, 0), yaw=yaw))
        before = f"mount_{i}"
        for k, (mass, centre, entries) in enumerate(LINKS):
            name = f"link_{i}_{k}"
            parts.append(link(name, mass, centre, 1e-6 * np.array(entries)))
            place = (name, PLACES[k], AXES[k])
            parts.append(joint(f"q_{i}_{k}", "revolute", before, *place, limits=RANGES[k]))
            before = name
        sphere = TIP_INERTIA * np.array([1, 0, 0, 1, 0, 1])
        parts.append(link(f"tip_{i}", TIP_MASS, (0, 0, 0), sphere))
        parts.append(joint(f"t_{i}", "fixed", before, f"tip_{i}", TIP))
    return f'<?xml version="1.0"?><robot name="trifinger">{"".join(parts)}{more}</robot>'


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "hand.urdf").write_text(urdf())
    (tmp_path / "base.toml").write_text(scenario_to_toml(trifinger()))
    return tmp_path


TIPS = ("tip_0", "tip_1", "tip_2")


def imported(folder, *more, tips=TIPS):
    return written(folder, "--scenario", str(folder / "base.toml"), *more, tips=tips)


def written(folder, *more, tips=TIPS, name="out.toml"):
    base = ("--base-pose", "0", "0", "0.29", "0", "0", "0")
    files = (str(folder / "hand.urdf"), "--output", str(folder / name))
    return main(["hands", "import", *files, "--tips", *tips, *base, *more])


def test_a_hand_from_a_file_is_the_one_written_by_hand(folder, capsys):
    assert imported(folder) == 0
    said = capsys.readouterr().out
    assert "they belong to no finger: camera, holder, mount_0" in said
    assert "merged, since they move together: link_0_2 with tip_0; link_1_2 with tip_1" in said
    made, wanted = load_scenario(folder / "out.toml"), trifinger()
    for ours, theirs in zip(made.fingers, wanted.fingers, strict=True):
        assert (ours.face, ours.friction, ours.kind) == (theirs.face, theirs.friction, "chain")
        np.testing.assert_allclose(ours.tip, theirs.tip)
        np.testing.assert_allclose(ours.posture, [0.2847, 0.7340, -1.8180], atol=5e-5)
        for k, (a, b) in enumerate(zip(ours.joints, theirs.joints, strict=True)):
            assert (a.minimum, a.maximum, a.torque_limit) == (*RANGES[k], 0.36)
            np.testing.assert_allclose(a.mass, b.mass)
            np.testing.assert_allclose(a.centre, b.centre, atol=1e-15)
            np.testing.assert_allclose(a.unit_inertia, b.unit_inertia, atol=1e-15)
    # The mounts turn the fingers, so that all have the attitude of the holder.
    turned = [finger.joints[0].attitude[3] for finger in made.fingers]
    np.testing.assert_allclose(np.abs(turned), [0.0, np.sin(np.pi / 3), np.sin(np.pi / 3)])


def test_what_cannot_be_imported_is_refused_in_one_sentence(folder, capsys):
    for more, tips, words in (
        ((), ("tip_0",), "1 fingertips for a scenario of 3 fingers"),
        ((), ("tip_9", "tip_1", "tip_2"), "there is no link 'tip_9'; did you mean"),
        (("--lock", "q_0_0=0.1"), TIPS, "2 of the 2 joints of 'tip_0' are"),
        (("--couple", "q_0_0=q_1_0,1"), TIPS, "2 of the 3 joints of 'tip_0' are independent"),
        (("--couple", "q_0_0=q_0_0,1"), TIPS, "joint 'q_0_0' follows itself"),
        (("--couple", "q_0_0=elbow,1"), TIPS, "there is no joint 'elbow'"),
        (("--couple", "q_0_0=q_0_1"), TIPS, "give JOINT=LEADER,RATIO"),
        (("--lock", "q_0_0"), TIPS, "give JOINT=POSITION"),
    ):
        assert imported(folder, *more, tips=tips) == 2
        assert words in capsys.readouterr().err
    mass = 'mass value="0.26689"'
    for text, words in (
        (urdf().replace(mass, 'mass value="2669"'), "joint 'q_0_0': mass: Input should be less"),
        (urdf().replace(mass, "mass"), "there is no 'value' of 'mass' in 'inertial'"),
        ("<!DOCTYPE robot><robot/>", "no document type"),
        ("<robot>", "cannot be read as URDF"),
    ):
        (folder / "hand.urdf").write_text(text)
        assert imported(folder) == 2
        assert words in capsys.readouterr().err
    assert not (folder / "out.toml").exists()


def test_locked_joints_and_what_is_fixed_become_one_link(folder):
    extra = link("cover", 0.02, (0, 0, 0), (0, 0, 0, 0, 0, 0)) + joint(
        "screw", "fixed", "link_0_1", "cover", (0.01, 0.0, 0.0)
    )
    wrist = '<link name="w"/>' + joint("wrist", "revolute", "base", "holder", (0, 0, 0), (0, 0, 1))
    text = urdf(extra + wrist + '<link name="base"/>')
    (folder / "hand.urdf").write_text(text)
    assert imported(folder, "--lock", "wrist=0") == 0
    made = load_scenario(folder / "out.toml").fingers
    assert made[0].joints[1].mass == pytest.approx(LINKS[1][0] + 0.02)
    assert made[1].joints[1].mass == pytest.approx(LINKS[1][0])


def test_fingers_alone_are_used_by_a_scenario_beside_them(folder, capsys):
    assert written(folder, name="hand.toml") == 0
    assert 'hand = "hand.toml"' in capsys.readouterr().out
    assert imported(folder) == 0
    whole = load_scenario(folder / "out.toml")
    # The faces of the scenario are kept, what its fingers were made of is not.
    (folder / "grasp.toml").write_text('hand = "hand.toml"\n' + scenario_to_toml(trifinger()))
    made = load_scenario(folder / "grasp.toml")
    np.testing.assert_allclose([f.posture for f in made.fingers], [(0.335, 0.785, -1.35)] * 3)
    as_whole = {
        f"fingers.{i}.posture.{k}": q
        for i in range(3)
        for k, q in enumerate(whole.fingers[i].posture)
    }
    assert with_values(made, as_whole) == whole
    starts = [first_seeds(scenario) for scenario in (made, whole)]
    for i, (a, b) in enumerate(zip(*starts, strict=True)):
        finger, tip = made.fingers[i], tip_at_start(made, i)
        chain = finger.attitude, finger.joints, finger.tip
        np.testing.assert_allclose(
            chain_positions(*chain, tip, a), chain_positions(*chain, tip, b), atol=1e-12
        )


def test_a_hand_file_that_does_not_fit_is_refused(folder):
    assert written(folder, name="hand.toml", tips=TIPS[:2]) == 0
    text = scenario_to_toml(trifinger())
    for name, words in (
        ("hand.toml", "it has 2 fingers, but the scenario has 3"),
        ("none.toml", "there is no such file"),
        ("../hand.toml", "outside the scenario's folder"),
        ("hand.urdf", "not valid TOML"),
    ):
        (folder / "grasp.toml").write_text(f'hand = "{name}"\n{text}')
        with pytest.raises(ScenarioError, match=words):
            load_scenario(folder / "grasp.toml")
    with pytest.raises(ScenarioError, match="allowed only in a scenario file on the disk"):
        scenario_from_mapping({"hand": "hand.toml"} | trifinger().to_mapping())


def test_limits_that_mean_that_there_are_none_are_left_out(folder):
    text = urdf().replace('lower="-2.7" upper="0.0" effort="0.36"', 'lower="-1e9" upper="1e9"')
    (folder / "hand.urdf").write_text(text)
    assert imported(folder) == 0
    last = load_scenario(folder / "out.toml").fingers[1].joints[2]
    assert (last.minimum, last.maximum, last.torque_limit) == (None, None, None)


def test_a_fourth_joint_is_locked_or_follows_another_one(folder, capsys):
    """The file may say so (mimic), or the command."""
    more = link("nail", 0.01, (0, 0, 0), (0, 0, 0, 0, 0, 0)) + '<link name="end"/>'
    more += joint("t", "fixed", "nail", "end", (0, 0, -0.02))
    tips = ("end", *TIPS[1:])
    knuckle = joint("k", "revolute", "tip_0", "nail", (0, 0, 0), limits=(-1.0, 1.0))
    (folder / "hand.urdf").write_text(urdf(more + knuckle))
    assert imported(folder, tips=tips) == 2
    said = capsys.readouterr().err
    assert "4 of the 4 joints of 'end' are independent" in said
    assert "--lock JOINT=POSITION" in said and "--couple JOINT=LEADER,RATIO" in said
    assert imported(folder, "--lock", "k=0.3", tips=tips) == 0
    locked = load_scenario(folder / "out.toml").fingers[0]
    assert len(locked.joints) == 3 and locked.joints[2].mass == pytest.approx(0.08669 + 0.01)
    coupled = []
    for given, name in (((), "mimic.toml"), (("--couple", "k=q_0_2,0.5,0.1"), "couple.toml")):
        mimic = "" if given else '<mimic joint="q_0_2" multiplier="0.5" offset="0.1"/>'
        knuckle = joint("k", "revolute", "tip_0", "nail", (0, 0, 0), limits=(-2, 1), more=mimic)
        (folder / "hand.urdf").write_text(urdf(more + knuckle))
        assert written(folder, *given, tips=tips, name=name) == 0
        coupled.append((folder / name).read_text())
    assert coupled[0].replace("mimic.toml", "couple.toml") == coupled[1]
    last = tomllib.loads(coupled[0])["fingers"][0]["joints"][3]
    assert (last["follows"], last["ratio"], last["offset"]) == (2, 0.5, 0.1)
    assert "torque_limit" not in last
    # What follows a locked joint stands still as well.
    locks = (*given, "--lock", "q_0_2=-1")
    assert written(folder, *locks, tips=tips, name="short.toml") == 2
    assert "2 of the 2 joints" in capsys.readouterr().err


SPHERE = '<geometry><sphere radius="0.01"/></geometry>'
OF_PACKAGE = '<geometry><mesh filename="package://robot/link.stl" scale="0.001 0.001 0.001"/>'
LINK_2 = '<link name="link_1_2">'


def with_visuals(*geometries):
    """The hand with visible shapes of the last link of the second finger, turned and moved."""
    place = '<origin xyz="0 0.1 0" rpy="1.5707963267948966 0 0"/>'
    visuals = "".join(f"<visual>{place}{each}</visual>" for each in geometries)
    return urdf().replace(LINK_2, LINK_2 + visuals)


def written_with(folder, *geometries, more=()):
    """Exit status of an import with visible shapes, as one more name of file."""
    (folder / "hand.urdf").write_text(with_visuals(*geometries))
    (folder / "hand.toml").unlink(missing_ok=True)
    return written(folder, *more, name="hand.toml")


def test_simple_shapes_are_meshes_in_the_frame_of_their_link(folder, capsys):
    for geometry, sizes in (
        (SPHERE, (0.02, 0.02, 0.02)),
        ('<geometry><box size="0.1 0.2 0.3"/></geometry>', (0.1, 0.3, 0.2)),
        ('<geometry><cylinder radius="0.1" length="0.5"/></geometry>', (0.2, 0.5, 0.2)),
        ('<geometry><capsule radius="0.1" length="0.5"/></geometry>', (0.2, 0.7, 0.2)),
    ):
        assert written_with(folder, geometry) == 0
        assert "meshes: hand.meshes.npz" in capsys.readouterr().out
        meshes = load_meshes(folder / "hand.meshes.npz")
        vertices = meshes.links[1][2].vertices
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        np.testing.assert_allclose(high - low, sizes, rtol=6e-3)
        np.testing.assert_allclose(0.5 * (low + high), (0.0, 0.1, 0.0), atol=1e-7)
        assert meshes.num_triangles == len(meshes.links[1][2].faces)


def test_a_mesh_file_is_found_beside_the_hand_and_in_its_packages(folder, capsys):
    box = trimesh.creation.box((100.0, 200.0, 300.0))
    (folder / "elsewhere" / "robot").mkdir(parents=True)
    box.export(folder / "elsewhere" / "robot" / "link.stl")
    given = f"{OF_PACKAGE}</geometry>"
    assert written_with(folder, given) == 0
    told = capsys.readouterr().err
    assert "no meshes written: the mesh file 'package://robot/link.stl' is in no folder" in told
    assert "name the folder that contains 'robot' with --packages" in told
    assert load_scenario_of(folder) and not (folder / "hand.meshes.npz").exists()
    for more, text in (
        (("--packages", str(folder / "elsewhere")), given),
        ((), given.replace("package://robot", "elsewhere/robot")),
        ((), given.replace("package://robot", f"file://{folder}/elsewhere/robot")),
        ((), given.replace("robot", "elsewhere/robot")),
    ):
        assert written_with(folder, text, more=more) == 0
        vertices = load_meshes(folder / "hand.meshes.npz").links[1][2].vertices
        np.testing.assert_allclose(np.ptp(vertices, axis=0), (0.1, 0.3, 0.2), atol=1e-7)
        (folder / "hand.meshes.npz").unlink()


def load_scenario_of(folder):
    (folder / "grasp.toml").write_text('hand = "hand.toml"\n' + scenario_to_toml(trifinger()))
    return load_scenario(folder / "grasp.toml")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("link.stl", b"solid", "contains no finite triangles; convert it to STL, OBJ"),
        ("link.ply", b"solid", "cannot be read; convert it to STL, OBJ, PLY or GLB"),
        ("link.dae", b"<COLLADA/>", "cannot be read; convert it to STL, OBJ, PLY or GLB"),
        ("link.obj", b"v 0 0 0\n", "convert it to STL, OBJ, PLY or GLB"),
        ("link.ply", trimesh.creation.icosphere(7), "has 327680 triangles, more than 200000"),
    ],
)
def test_a_mesh_file_that_cannot_be_drawn_is_named_and_the_hand_complete(
    folder, capsys, name, content, words
):
    path = folder / name
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        content.export(path)
    assert written_with(folder, f'<geometry><mesh filename="{name}"/></geometry>') == 0
    told = capsys.readouterr().err
    assert f"no meshes written: the mesh file '{path}' " in told and words in told
    assert told.count("\n") == 1 and load_scenario_of(folder)


def test_shapes_that_are_none_of_urdf_or_too_many_are_refused_in_one_sentence(folder, capsys):
    trimesh.creation.icosphere(6).export(folder / "ball.stl")  # 81920 triangles
    ball = '<geometry><mesh filename="ball.stl"/></geometry>'
    for geometries, words in (
        ([ball] * 3, "the meshes have 245760 triangles, more than 200000"),
        (['<geometry><cone radius="1"/></geometry>'], "a visible shape of the file cannot"),
        (['<geometry><sphere radius="round"/></geometry>'], "a visible shape of the file cannot"),
        (['<geometry><box size="1 2"/></geometry>'], "a visible shape of the file cannot"),
    ):
        assert written_with(folder, *geometries) == 0
        assert f"no meshes written: {words}" in capsys.readouterr().err
    assert written_with(folder) == 0
    assert "meshes: none, since the file has no visible shapes" in capsys.readouterr().out
    assert not (folder / "hand.meshes.npz").exists()


def test_meshes_are_those_of_their_fingers_whatever_they_weigh_and_wherever_they_are(folder):
    assert written_with(folder, SPHERE) == 0
    meshes, scenario = load_meshes(folder / "hand.meshes.npz"), load_scenario_of(folder)
    assert meshes.fit(scenario)
    same = {"fingers.0.joints.1.mass": 0.3, "fingers.1.friction": 0.2, "fingers.2.base.0": 0.01}
    assert meshes.fit(with_values(scenario, same))
    for key, value in (("fingers.0.joints.1.place.0", 0.02), ("fingers.1.tip.0", 0.02)):
        assert not meshes.fit(with_values(scenario, {key: value}))
    assert not meshes.fit(load_scenario("spatial-prism"))
    assert not meshes.fit(load_scenario("paper-case-1"))
    assert imported(folder) == 0
    assert load_meshes(folder / "out.meshes.npz").fit(load_scenario(folder / "out.toml"))


def test_a_scenario_and_its_recording_name_no_file_of_the_hand(folder):
    assert written_with(folder, SPHERE) == 0
    scenario = with_values(load_scenario_of(folder), {"simulation.duration": 0.01})
    path = folder / "run.mcap"
    write_recording(simulate(scenario), path)
    assert read_recording(path).scenario == scenario
    with path.open("rb") as stream:
        reader = make_reader(stream)
        contents = [message.data for _, _, message in reader.iter_messages()]
        contents += [str(each.metadata).encode() for each in reader.iter_metadata()]
    for text in (scenario_to_toml(scenario).encode(), *contents):
        assert not any(name in text for name in (b"hand.toml", b".npz", b".urdf", b"meshes"))


def test_damaged_meshes_are_refused(folder):
    assert written_with(folder, SPHERE) == 0
    path = folder / "hand.meshes.npz"
    whole = path.read_bytes()
    arrays = dict(np.load(path))
    for content in (b"", b"PK", whole[:-100], whole[:200] + b"?" + whole[201:]):
        path.write_bytes(content)
        with pytest.raises(ScenarioError, match=r"is damaged; 'slipgrasp hands import' writes"):
            load_meshes(path)
    for wrong in (
        {"base.faces": np.array([[0, 1, 2]], np.uint32)},
        {"base.vertices": np.zeros((3, 2), np.float32)},
        {"base.vertices": np.array([{}], object)},
        {"chains": np.array("no JSON")},
        {"chains": np.array("[1]")},
    ):
        np.savez(path, **arrays | wrong)
        with pytest.raises(ScenarioError, match="is damaged"):
            load_meshes(path)


def test_a_dashboard_does_not_start_with_a_hand_that_is_no_hand(folder, capsys):
    assert written_with(folder, SPHERE) == 0
    load_scenario_of(folder)
    (folder / "other.toml").write_text(scenario_to_toml(trifinger()))
    (folder / "other.meshes.npz").write_bytes((folder / "hand.meshes.npz").read_bytes())
    (folder / "hand.meshes.npz").write_bytes(b"")
    for name, words in (
        ("none.toml", "none.toml' cannot be read: No such file or directory"),
        ("hand.urdf", "hand.urdf' cannot be read: it is not TOML"),
        ("hand.toml", "hand.meshes.npz' is damaged; 'slipgrasp hands import' writes it again"),
        ("grasp.toml", "hand.meshes.npz' is damaged"),
        ("other.toml", "other.meshes.npz' has meshes of other fingers; import the hand again"),
    ):
        assert main(["serve", "--port", "0", "--hand", str(folder / name)]) == 2
        told = capsys.readouterr().err
        assert words in told and told.count("\n") == 1
