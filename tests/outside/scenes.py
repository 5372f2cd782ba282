"""Scenes that the command writes for the tests of all engines, and slips of an engine in them."""

import json
from pathlib import Path

import numpy as np

import slipgrasp.core.scenario
from slipgrasp.cli.main import main

PRESETS = Path(slipgrasp.core.scenario.__file__).parent / "presets"

# All presets that a scene can show.
SHOWN = [
    *("paper-case-1", "paper-case-2", "composite-case-2", "composite-case-2-noisy"),
    *("three-fingers", "unequal-fingers", "wide-object", "shake-test", "gripper-lift"),
    *("spatial-prism", "spatial-box", "spatial-composite", "spatial-composite-noisy"),
    "spatial-unknown-friction",
]
# Fingers on slides: jaws that lift from the start instead of after half a second, and presets of
# links with slides in their place.
ON_SLIDES = {
    "gripper-lift": {"trajectory.set_points.0.time": 0.0},
    "composite-case-2": {f"fingers.{i}.kind": "slides" for i in range(2)},
    "spatial-composite": {f"fingers.{i}.kind": "slides" for i in range(3)},
}
# One face becomes smoother.
SMOOTHER = """
[[changes]]
time = 0.1
parameter = "fingers.0.friction"
value = 0.15
"""


def write(folder, preset, form, suffix="scene", assignments=None):
    """The file of a scene, and the expected result."""
    path, more = folder / f"hold.{suffix}", []
    for key, value in (assignments or {}).items():
        more += ["--set", f"{key}={value}"]
    assert main(["scene", str(preset), "--format", form, "--output", str(path), *more]) == 0
    return path, json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))


def smoother(folder, preset):
    """A preset in which the friction of the first finger falls during the run."""
    path = folder / f"{preset}.toml"
    text = (PRESETS / f"{preset}.toml").read_text(encoding="utf-8")
    path.write_text(text + SMOOTHER, encoding="utf-8")
    return path


def slip(contacts, tips, place, turn):
    """Slips of all tips with the object at a place and turned by a matrix, as the docs say."""
    return np.concatenate(
        [
            np.array(contact["tangents"]) @ (turn.T @ (tip - place) - contact["anchor"])
            for contact, tip in zip(contacts, tips, strict=True)
        ]
    )


def largest_error(slips, answer):
    """Of the slips at the end of every step, at the stated times [m]."""
    steps = np.rint(np.array(answer["times"]) / answer["step"]).astype(int) - 1
    assert len(slips) == len(answer["torques"])
    return np.abs(np.array(slips)[steps] - answer["slip"]).max()
