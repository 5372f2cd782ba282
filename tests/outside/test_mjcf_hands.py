"""Hands from MJCF files: as MuJoCo moves them, and as from the URDF file of the same hand."""

import mujoco
import numpy as np
import pytest

from slipgrasp.cli.main import main
from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario.hand_files.description import Description
from slipgrasp.core.scenario.hand_files.mjcf import read_mjcf, read_mjcf_visuals
from slipgrasp.core.scenario.hand_files.urdf import read_urdf
from slipgrasp.core.scenario.hand_files.visuals import meshes_of
from tests.drawn_meshes import assert_same_points, drawn_vertices
from tests.outside.test_pinocchio_chains import GRAVITY, by_kernel, written
from tests.slipgrasp.test_hands_command import TIPS, urdf

pytestmark = pytest.mark.slow

BALL = (
    '<mujoco><worldbody><body name="a"><joint type="ball"/><geom size="0.1"/><site name="tip"/>'
    "</body></worldbody></mujoco>"
)


def inertial(rng):
    principal = rng.uniform(1.0, 1.5, 3)
    return (
        f'<inertial mass="{rng.uniform(0.2, 2.0)!r}" pos="{written(rng.normal(size=3))}" '
        f'quat="{written(rng.normal(size=4))}" diaginertia="{written(principal)}"/>'
    )


def joint(rng, number):
    kind = rng.choice(["hinge", "slide"])
    return (
        f'<joint name="j{number}" type="{kind}" axis="{written(rng.normal(size=3))}" '
        f'pos="{written(rng.normal(size=3))}" ref="0.3" range="-2 2"/>'
    )


def random_file(rng, follows):
    """Bodies with two joints, one, none and one: the last follows the first where asked."""
    parts, number = [], 0
    for body, count in enumerate((2, 1, 0, 1)):
        parts.append(
            f'<body name="b{body}" pos="{written(rng.normal(size=3))}" '
            f'quat="{written(rng.normal(size=4))}">{inertial(rng)}'
        )
        for _ in range(count):
            parts.append(joint(rng, number))
            number += 1
    parts.append(f'<site name="tip" pos="{written(rng.normal(size=3))}"/>' + "</body>" * 4)
    equality = '<joint joint1="j3" joint2="j0" polycoef="0.1 -0.7 0 0 0"/>' if follows else ""
    return (
        f'<mujoco><compiler angle="radian"/><option gravity="0 0 -{GRAVITY}"/>'
        f"<worldbody>{''.join(parts)}</worldbody><equality>{equality}</equality>"
        '<actuator><motor joint="j1" gear="-2" forcerange="-1 3"/></actuator></mujoco>'
    )


@pytest.mark.parametrize("follows", [False, True])
@pytest.mark.parametrize("seed", range(10))
def test_random_chains_move_as_in_mujoco(tmp_path, seed, follows):
    rng = np.random.default_rng(seed)
    path = tmp_path / "hand.xml"
    path.write_text(random_file(rng, follows))
    locked = {} if follows else {"j2": 0.4}
    read = Description(*read_mjcf(path, ["tip"]), locked).finger("tip")
    q, rates = rng.uniform(-0.5, 0.5, 3), rng.normal(size=3)
    _, ours = by_kernel(read, q, rates)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    matrix, offset = np.zeros((4, 3)), np.zeros(4)
    if follows:
        matrix[:3], matrix[3, 0], offset[3] = np.eye(3), -0.7, 0.1
    else:
        matrix[[0, 1, 3]], offset[2] = np.eye(3), 0.4
    data.qpos, data.qvel = model.qpos0 + matrix @ q + offset, matrix @ rates
    mujoco.mj_forward(model, data)
    full, jacobian = np.zeros((4, 4)), np.zeros((3, 4))
    for row, unit in zip(full, np.eye(4), strict=True):
        mujoco.mj_mulM(model, data, row, unit)
    mujoco.mj_jacSite(model, data, jacobian, None, 0)
    np.testing.assert_allclose(ours.inertia, matrix.T @ full @ matrix, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(ours.bias, matrix.T @ data.qfrc_bias, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(ours.tip, data.site_xpos[0], atol=1e-10)
    np.testing.assert_allclose(ours.jacobian, jacobian @ matrix, atol=1e-10)
    assert [each.torque_limit for each in read.joints][1] == 6.0
    assert (read.joints[0].minimum, read.joints[0].maximum) == pytest.approx((-2.3, 1.7))


def test_a_hand_is_the_same_from_urdf_and_from_mjcf(tmp_path):
    keep = '<mujoco><compiler fusestatic="false"/></mujoco>'
    spec = mujoco.MjSpec.from_string(urdf(keep))
    spec.compile()
    path, made = tmp_path / "hand.xml", tmp_path / "hand.toml"
    path.write_text(spec.to_xml())
    ours = Description(*read_mjcf(path, TIPS))
    theirs = Description(*read_urdf(urdf()))
    for tip in TIPS:
        a, b = ours.finger(tip), theirs.finger(tip)
        np.testing.assert_allclose(a.tip, b.tip, atol=1e-6)
        for one, other in zip(a.joints, b.joints, strict=True):
            np.testing.assert_allclose(one.place, other.place, atol=1e-6)
            np.testing.assert_allclose(one.mass, other.mass, rtol=1e-5)
            np.testing.assert_allclose(one.centre, other.centre, atol=1e-5)
            np.testing.assert_allclose(one.unit_inertia, other.unit_inertia, rtol=1e-3, atol=1e-6)
            assert one.minimum == pytest.approx(other.minimum, abs=1e-5)
    assert main(["hands", "import", str(path), "--tips", *TIPS, "--output", str(made)]) == 0
    assert made.read_text().count('kind = "chain"') == 3


def test_what_mujoco_or_a_chain_cannot_have_is_refused_in_one_sentence(tmp_path):
    path = tmp_path / "hand.xml"
    rng = np.random.default_rng(0)
    for text, words in (
        ("<mujoco><worldbody><geom/></worldbody></mujoco>", "MuJoCo does not accept 'hand.xml'"),
        (random_file(rng, True).replace("-0.7 0", "-0.7 1"), "'j3' follows by a polynomial"),
        (BALL, "is 'ball', a chain has"),
    ):
        path.write_text(text)
        with pytest.raises(ScenarioError, match=words):
            Description(*read_mjcf(path, ["tip"])).finger("tip")


SHAPES = (
    '<geom type="box" size="0.3 0.2 0.1" pos="0.1 0 0.2" euler="0.3 0.2 0.1"/>',
    '<geom type="mesh" mesh="wedge" pos="0 0.2 0" euler="0 0.5 0"/>',
    '<geom type="box" size="1 1 1" group="3"/>',  # of collisions
    '<geom type="plane" size="1 1 1"/>',
)


def shaped(rng):
    """A random file whose base and bodies have boxes and meshes."""
    text = random_file(rng, follows=False)
    wedge = '<asset><mesh name="wedge" vertex="0 0 0 0.3 0 0 0 0.2 0 0 0 0.1"/></asset>'
    text = text.replace("<worldbody>", f"{wedge}<worldbody>{''.join(SHAPES)}")
    return text.replace("<inertial", f"{''.join(SHAPES[:3])}<inertial")


def corners_in_mujoco(model, data):
    found = []
    for k in np.flatnonzero(model.geom_group < 3):
        corners = np.zeros((0, 3))
        if model.geom_type[k] == mujoco.mjtGeom.mjGEOM_BOX:
            signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
            corners = signs * model.geom_size[k]
        if model.geom_type[k] == mujoco.mjtGeom.mjGEOM_MESH:
            corners = model.mesh_vert.astype(float)
        found.append(corners @ data.geom_xmat[k].reshape(3, 3).T + data.geom_xpos[k])
    return np.concatenate(found)


def test_shapes_move_as_in_mujoco_and_those_of_collisions_are_left_out(tmp_path):
    rng = np.random.default_rng(3)
    path = tmp_path / "hand.xml"
    path.write_text(shaped(rng))
    hand = Description(*read_mjcf(path, ["tip"]), {"j2": 0.4})
    fingers, q = [hand.finger("tip")], rng.uniform(-0.5, 0.5, 3)
    ours = drawn_vertices(fingers, meshes_of(hand, fingers, read_mjcf_visuals(path)), q[None])
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:] = model.qpos0 + np.array([q[0], q[1], 0.4, q[2]])
    mujoco.mj_kinematics(model, data)
    assert_same_points(ours, corners_in_mujoco(model, data))
