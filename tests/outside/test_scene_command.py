"""``slipgrasp scene`` for MuJoCo, which opens the file and reproduces the expected result."""

import mujoco
import numpy as np
import pytest

from slipgrasp.cli.main import main
from tests.fenced_blocks import DOCS, blocks_of, output_of
from tests.outside.scenes import ON_SLIDES, SHOWN, largest_error, slip, smoother, write

PAGE = (DOCS / "peers.md").read_text(encoding="utf-8")

pytestmark = pytest.mark.slow


def play(path, answer):
    """Slips of MuJoCo at the end of every step."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    assert model.opt.timestep == answer["step"]
    slips, changes = [], list(answer["friction_changes"])
    for k, torques in enumerate(answer["torques"]):
        while changes and changes[0]["time"] < (k + 0.5) * answer["step"]:
            change = changes.pop(0)
            model.geom(f"tip{change['contact']}").friction[0] = change["friction"]
        data.ctrl[:] = torques
        mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        body = data.body("object")
        tips = [data.site(contact["site"]).xpos for contact in answer["contacts"]]
        slips.append(slip(answer["contacts"], tips, body.xpos, body.xmat.reshape(3, 3)))
    return slips


@pytest.mark.parametrize("preset", SHOWN)
def test_mujoco_reproduces_the_expected_slips_within_the_tolerance(tmp_path, preset, capsys):
    path, answer = write(tmp_path, preset, "mjcf")
    check(path, answer)


@pytest.mark.parametrize("preset", ON_SLIDES)
def test_mujoco_plays_fingers_on_slides(tmp_path, preset, capsys):
    check(*write(tmp_path, preset, "mjcf", assignments=ON_SLIDES[preset]))


@pytest.mark.parametrize("preset", ["gripper-lift", "composite-case-2"])
def test_mujoco_plays_a_change_of_friction(tmp_path, preset, capsys):
    path, answer = write(tmp_path, smoother(tmp_path, preset), "mjcf")
    check(path, answer)
    # The change matters: without it the slips are others.
    unchanged = play(path, {**answer, "friction_changes": []})
    assert largest_error(unchanged, answer) > answer["tolerance"]["slip"]


def check(path, answer):
    assert largest_error(play(path, answer), answer) < answer["tolerance"]["slip"]
    # Tight: a slip that is wrong by a hundredth is found.
    assert answer["tolerance"]["slip"] < 0.01 * np.abs(answer["slip"]).max() + 2e-5
    assert answer["creep"] == 0.0


def test_the_example_of_the_page_prints_equal_slips(tmp_path, monkeypatch, capsys):
    write(tmp_path, "paper-case-1", "mjcf", suffix="xml")
    capsys.readouterr()
    (example,) = blocks_of(PAGE, "python")
    monkeypatch.chdir(tmp_path)
    lines = [
        line.replace("[", " ").replace("]", " ").split()
        for line in output_of(example.text, {}).splitlines()
    ]
    assert len(lines) == 2
    for found, expected in lines:
        assert float(found) == pytest.approx(float(expected), rel=2e-3)


@pytest.mark.parametrize(
    ("preset", "words"),
    [
        ("trifinger", "chains"),
        ("parallel-gripper", "soft pads"),
        ("wet-patch", "patches"),
        ("poured-mass", "timed changes"),
        ("tilted-object", "corners"),
        ("spatial-bottle", "round objects"),
        ("spatial-pyramid", "pyramids"),
    ],
)
def test_what_the_scene_cannot_have_is_refused(tmp_path, preset, words, capsys):
    path = tmp_path / "hold.xml"
    assert main(["scene", preset, "--output", str(path)]) == 2
    assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_scene_does_not_replace_its_own_expected_result(tmp_path, capsys):
    file = tmp_path / "hold.json"
    assert main(["scene", "paper-case-1", "--output", str(file)]) == 2
    assert "use another suffix" in capsys.readouterr().err and not file.exists()
