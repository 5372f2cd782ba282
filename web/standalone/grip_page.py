"""The page "Why does my object slip?": five numbers of a grip between two pads, and the answer.

Its formulas are traced from the functions of this module, which also contains its sentences.
"""

from __future__ import annotations

import json
from importlib import resources
from typing import Any, NamedTuple

import numpy as np

from slipgrasp.web.standalone.traced import Program, inputs

GRAVITY = 9.81  # [m/s²]
WAY = 0.01  # slip after which the object counts as lost [m]
_EVEN_PAD = 2.0 / 3.0  # moment over force of a turning pad with uniform pressure, per radius


class Grip(NamedTuple):
    """Input, in SI units; positive acceleration is upward."""

    mass: Any
    friction: Any
    grip_force: Any
    pad_radius: Any
    acceleration: Any


class GripAnswer(NamedTuple):
    """Results for a grip.

    Attributes:
        force: Least grip force without slip [N].
        friction: Least friction without slip.
        acceleration: Largest acceleration without slip [m/s²].
        fall: Acceleration of the object relative to the pads while it slips [m/s²]; else at most 0.
        time: Time until it has slipped by `WAY` [s]; NaN if it does not slip.
        arm: Largest distance between pads and centre of mass at which it does not turn [m]; NaN if
            it slips.
    """

    force: Any
    friction: Any
    acceleration: Any
    fall: Any
    time: Any
    arm: Any


def answer_of(grip: Grip) -> GripAnswer:
    """Computes the results; two pads share the load P = m (g + a), friction is at most 2 mu F.

    Force and moment of a pad are within its limit surface (P / 2 mu F)² + (P d / 2 mu F c)² = 1,
    with c = 2/3 of the radius. The arm d is therefore at most c sqrt((2 mu F / P)² - 1).
    """
    load = grip.mass * (GRAVITY + grip.acceleration)
    offered = 2.0 * grip.friction * grip.grip_force
    fall = (load - offered) / grip.mass
    with np.errstate(invalid="ignore"):
        time = np.sqrt(2.0 * WAY / fall)
        arm = _EVEN_PAD * grip.pad_radius * np.sqrt((offered / load) ** 2 - 1.0)
    return GripAnswer(
        force=load / (2.0 * grip.friction),
        friction=load / (2.0 * grip.grip_force),
        acceleration=offered / grip.mass - GRAVITY,
        fall=fall,
        time=time,
        arm=arm,
    )


FIELDS = {
    "mass": ("mass of the object [kg]", 0.4),
    "friction": ("friction coefficient", 0.35),
    "grip_force": ("grip force of each pad [N]", 6.5),
    "pad_radius": ("radius of the pads [mm], 0 for points", 10.0),
    "acceleration": ("upward acceleration [m/s²]", 2.3),
}
_SCALES = {"pad_radius": 1e-3}

SENTENCES = {
    "slips": "<b>Slips.</b> The pads pass on too little friction; after {time} ms the object has "
    "slipped 1 cm. What to change: a grip force of at least {force} N, friction of at least "
    "{friction}, or {slower}.",
    "slower": "an acceleration of at most {acceleration} m/s²",
    "lighter": "a lighter object: it slips at rest, too",
    "pivots": "<b>Holds, but pivots.</b> The grip force suffices from {force} N on, but points do "
    "not resist turning: unless they lie exactly beside or above the centre of mass, the object "
    "turns about the line between them. What to change: larger pads, or a third contact.",
    "holds": "<b>Holds.</b> The grip force suffices from {force} N on. It does not pivot if the "
    "pads are within {arm} mm of the centre of mass; farther away it does. What to change then: a "
    "larger grip force or larger pads.",
}
"""Text of the page, with placeholders; ``slower`` or ``lighter`` replaces ``{slower}``."""


def grip_page() -> str:
    """Returns the page as one HTML file."""
    entered = Grip(*inputs("i", len(FIELDS)))
    program = Program()
    order = program.add(np.array(answer_of(entered), dtype=object))
    data = {
        "fields": list(FIELDS),
        "scales": [_SCALES.get(name, 1.0) for name in FIELDS],
        "answers": GripAnswer._fields,
        "sentences": SENTENCES,
    }
    rows = "".join(
        f'<label>{label}<input type="number" step="any" min="0" name="{name}" value="{value:g}">'
        "</label>"
        for name, (label, value) in FIELDS.items()
    )
    template = resources.files("slipgrasp.web.standalone").joinpath("grip_page.html")
    page = template.read_text(encoding="utf-8")
    page = page.replace("<!-- fields -->", rows)
    page = page.replace("/* formulas */", f"const formulas = {program.to_javascript('i', order)};")
    return page.replace("/* data */", f"const data = {json.dumps(data)};")
