"""``slipgrasp scene``: the engine opens what is written, and reproduces the expected answer."""

import json
import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from slipgrasp.cli.main import main

PAGE = Path(__file__).parents[2] / "docs" / "peers.md"

pytestmark = pytest.mark.slow


def write(folder, preset, *more):
    path = folder / "hold.xml"
    assert main(["scene", preset, "--format", "mjcf", "--output", str(path), *more]) == 0
    return path, json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))


def play(path, answer):
    """Slips of MuJoCo at the stated times, and at the end of every step."""
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    assert model.opt.timestep == answer["step"]
    slips = []
    for torques in answer["torques"]:
        data.ctrl[:] = torques
        mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        slips.append(slip(data, answer["contacts"]))
    steps = np.rint(np.array(answer["times"]) / answer["step"]).astype(int) - 1
    return np.array(slips)[steps], np.array(slips)


def slip(data, contacts):
    """As the docs say: tangents (R' (x - p) - anchor)."""
    body = data.body("object")
    turn = body.xmat.reshape(3, 3).T
    found = []
    for contact in contacts:
        tip = turn @ (data.site(contact["site"]).xpos - body.xpos) - contact["anchor"]
        found += list(np.array(contact["tangents"]) @ tip)
    return found


@pytest.mark.parametrize(
    "preset",
    [
        *("paper-case-1", "paper-case-2", "composite-case-2-noisy", "three-fingers"),
        *("unequal-fingers", "wide-object", "shake-test", "spatial-prism", "spatial-box"),
        *("spatial-composite", "spatial-unknown-friction"),
    ],
)
def test_mujoco_reproduces_the_expected_slips_within_the_tolerance(tmp_path, preset, capsys):
    path, answer = write(tmp_path, preset)
    stated, every = play(path, answer)
    expected = np.array(answer["slip"])
    error = np.abs(stated - expected).max()
    assert error < answer["tolerance"]["slip"]
    # Tight: a slip that is wrong by a hundredth is found.
    assert answer["tolerance"]["slip"] < 0.01 * np.abs(expected).max() + 2e-5
    assert answer["creep"] == 0.0
    assert len(every) == len(answer["torques"])


def test_the_example_of_the_page_prints_equal_slips(tmp_path, monkeypatch, capsys):
    write(tmp_path, "paper-case-1")
    capsys.readouterr()
    (example,) = re.findall(r"^```python\n(.*?)^```$", PAGE.read_text("utf-8"), re.M | re.S)
    monkeypatch.chdir(tmp_path)
    exec(compile(example, "peers.md", "exec"), {})
    lines = [
        line.replace("[", " ").replace("]", " ").split()
        for line in capsys.readouterr().out.splitlines()
    ]
    assert len(lines) == 2
    for found, expected in lines:
        assert float(found) == pytest.approx(float(expected), rel=2e-3)


@pytest.mark.parametrize(
    ("preset", "words"),
    [
        ("gripper-lift", "slides"),
        ("wet-patch", "patches"),
        ("poured-mass", "timed changes"),
        ("tilted-object", "corners"),
        ("spatial-bottle", "round objects"),
    ],
)
def test_what_the_scene_cannot_have_is_refused(tmp_path, preset, words, capsys):
    path = tmp_path / "hold.xml"
    assert main(["scene", preset, "--output", str(path)]) == 2
    assert words in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
