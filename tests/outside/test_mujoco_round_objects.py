"""Tips that slip around a cylinder and a sphere under constant forces, beside MuJoCo's contacts.

MuJoCo's tips are balls, whose middles slide at the radius of our object on one that is smaller by
their radius: as they shrink the motion must become that of points.
"""

import mujoco
import numpy as np
import pytest

from slipgrasp import register_law, simulate
from slipgrasp.core.scenario.loading import scenario_from_mapping

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("known_laws")]

RADIUS, FRICTION, DURATION, TIP_MASS = 0.1, 0.3, 0.08, 0.1
FORCES = np.array([[10.0, 3.1, 0.6], [-10.1, -2.95, -0.3]])
MOMENT = (0.2, -0.1, 1.2)
INERTIAS = (0.006, 0.005, 0.004)
STARTS = np.array([-RADIUS, 0.0, 0.0, RADIUS, 0.0, 0.0])
STEP = 1e-5  # [s]
GEOMS = {"cylinder": "{size} 0.2", "sphere": "{size}"}


class Forces:
    """The same forces all the time."""

    name = "constant-forces"

    def command(self, seen, memory, out):
        out.torque[:] = FORCES


def our_end(shape):
    """Pose of the object and places of both tips at the end, and how far they have slipped."""
    register_law(Forces)
    fingers = [
        {"kind": "slides", "base": [0.0] * 3, "face": face, "friction": FRICTION, "mass": TIP_MASS}
        for face in ("side-3", "side-1")
    ]
    pulse = {"time": 0.0, "duration": DURATION, "force": [0.0] * 3, "moment": list(MOMENT)}
    body = {"shape": shape, "radius": RADIUS, "height": 0.4, "mass": 1.0}
    run = simulate(
        scenario_from_mapping(
            {
                "object": {**body, "inertias": list(INERTIAS)},
                "fingers": fingers,
                "trajectory": {"start": [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]},
                "controller": {"kind": Forces.name, "control_period": 0.001},
                "pulses": [pulse],
                "simulation": {"gravity": 0.0, "duration": DURATION},
            }
        )
    )
    trace = run.trace
    assert run.end_time == DURATION
    return np.concatenate([trace.object_pose[-1], trace.joint_position[-1]]), trace.slip_path[-1]


def end_in_mujoco(shape, tip):
    """The same where tips are balls of a radius."""
    sides = (("left", -1.0), ("right", 1.0))
    size = GEOMS[shape].format(size=RADIUS - tip)
    jaws = "".join(
        f"""
        <body name="{name}" pos="{side * RADIUS} 0 0">
          <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/>
          <joint type="slide" axis="0 0 1"/>
          <inertial pos="0 0 0" mass="{TIP_MASS}" diaginertia="1e-6 1e-6 1e-6"/>
          <geom name="{name}" type="sphere" size="{tip}" contype="0" conaffinity="0"/>
        </body>"""
        for name, side in sides
    )
    pairs = "".join(
        f"""<pair geom1="{name}" geom2="object" condim="3" friction="{FRICTION} {FRICTION} 0 0 0"
              solref="{4.0 * STEP} 1" solimp="0.99 0.999 0.00001"/>"""
        for name, _ in sides
    )
    inertia = " ".join(map(str, INERTIAS))
    hand = mujoco.MjModel.from_xml_string(f"""
        <mujoco>
          <option timestep="{STEP}" cone="elliptic" gravity="0 0 0" solver="Newton"
            tolerance="1e-14" iterations="100" impratio="10"/>
          <worldbody>
            <body>
              <freejoint/>
              <inertial pos="0 0 0" mass="1" diaginertia="{inertia}"/>
              <geom name="object" type="{shape}" size="{size}" contype="0" conaffinity="0"/>
            </body>
            {jaws}
          </worldbody>
          <contact>{pairs}</contact>
        </mujoco>""")
    data = mujoco.MjData(hand)
    data.qfrc_applied[6:12] = FORCES.ravel()
    for _ in range(round(DURATION / STEP)):
        data.xfrc_applied[1, 3:] = MOMENT
        mujoco.mj_step(hand, data)
    return np.concatenate([data.qpos[:7], STARTS + data.qpos[7:13]])


@pytest.mark.parametrize("shape", GEOMS)
def test_tips_slip_around_a_round_object_as_in_mujoco(shape):
    """By half a radius; MuJoCo's contacts give way by some 0.1 mm."""
    ours, paths = our_end(shape)
    assert paths.max() > 0.5 * RADIUS
    coarse, fine = (end_in_mujoco(shape, tip) for tip in (1e-3, 5e-4))
    turn = 6  # the part of the quaternion about z
    assert coarse[turn] - ours[turn] == pytest.approx(2.0 * (fine[turn] - ours[turn]), rel=0.02)
    limit = 2.0 * fine - coarse
    np.testing.assert_allclose(limit[:3], ours[:3], atol=2e-5)
    np.testing.assert_allclose(limit[3:7], ours[3:7], atol=5e-5)
    np.testing.assert_allclose(limit[7:], ours[7:], atol=2e-4)
