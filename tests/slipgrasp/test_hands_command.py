"""``slipgrasp hands import``: a TriFinger from its URDF is the one written by hand."""

import numpy as np
import pytest

from slipgrasp.cli.main import main
from slipgrasp.core.scenario.loading import load_scenario, scenario_to_toml
from tests.core.test_chains import AXES, LINKS, PLACES, TIP, TIP_INERTIA, TIP_MASS, trifinger

NAMES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
RANGES = ((-0.33, 1.0), (0.0, 1.57), (-2.7, 0.0))


def xyz(vector):
    return " ".join(f"{x!r}" for x in map(float, vector))


def link(name, mass, centre, entries):
    inertia = " ".join(f'{k}="{v!r}"' for k, v in zip(NAMES, map(float, entries), strict=True))
    return (
        f'<link name="{name}"><inertial><origin xyz="{xyz(centre)}"/><mass value="{mass!r}"/>'
        f"<inertia {inertia}/></inertial></link>"
    )


def joint(name, kind, parent, child, place, axis=(1, 0, 0), yaw=0.0, limits=(0.0, 0.0)):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz(place)}" rpy="0 0 {float(yaw)!r}"/><axis xyz="{xyz(axis)}"/>'
        f'<limit lower="{limits[0]}" upper="{limits[1]}" effort="1" velocity="1"/></joint>'
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


def imported(folder, *more, tips=("tip_0", "tip_1", "tip_2")):
    base = ("--base", "0", "0", "0.29", "0", "0", "0")
    files = ("--scenario", str(folder / "base.toml"), "--output", str(folder / "out.toml"))
    return main(
        ["hands", "import", str(folder / "hand.urdf"), "--tips", *tips, *files, *base, *more]
    )


def test_a_hand_from_a_file_is_the_one_written_by_hand(folder, capsys):
    assert imported(folder) == 0
    assert "links that move with none of them: camera, holder, mount_0" in capsys.readouterr().out
    made, wanted = load_scenario(folder / "out.toml"), trifinger()
    for ours, theirs in zip(made.fingers, wanted.fingers, strict=True):
        assert (ours.face, ours.friction, ours.kind) == (theirs.face, theirs.friction, "chain")
        np.testing.assert_allclose(ours.tip, theirs.tip)
        np.testing.assert_allclose(ours.posture, [0.2847, 0.7340, -1.8180], atol=5e-5)
        for a, b in zip(ours.joints, theirs.joints, strict=True):
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
        (("--lock", "q_0_0=0.1"), ("tip_0", "tip_1", "tip_2"), "has 2 moving joints"),
        (("--lock", "elbow=0.1"), ("tip_0", "tip_1", "tip_2"), "there is no joint 'elbow'"),
        (("--lock", "q_0_0"), ("tip_0", "tip_1", "tip_2"), "give JOINT=POSITION"),
    ):
        assert imported(folder, *more, tips=tips) == 2
        assert words in capsys.readouterr().err
    (folder / "hand.urdf").write_text("<!DOCTYPE robot><robot/>")
    assert imported(folder) == 2
    assert "no document type" in capsys.readouterr().err
    (folder / "hand.urdf").write_text("<robot>")
    assert imported(folder) == 2
    assert "cannot be read as URDF" in capsys.readouterr().err
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
