"""`python -m benchmarks.drake_replay`: our torques in Drake, ever finer and ever stiffer.

Drake is in no extra of this package: `pip install drake` first. It is imported only when a
replay starts. Its SAP solver knows several convex approximations of a contact. The one called
``sap`` lets sliding bodies glide at a distance of mu times speed times relaxation time, more
than our contacts are pressed in where case II slides fast: there its slip stops converging at
50 um. ``similar`` glides less.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.replay import (
    CASES,
    DURATION,
    STEPS,
    Differences,
    Replay,
    compare,
    format_table,
    record_case,
    slip_of,
)
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import FingerParameters, Scenario
from slipgrasp.core.scenario.geometry import contact_frame
from slipgrasp.recordings.engines.expected import mean_torques

Floats = NDArray[np.float64]

APPROXIMATIONS = {"sap": "kSap", "similar": "kSimilar"}  # our names, Drake's

_TIP_RADIUS = 1e-5  # [m]
_APPARENT_MASS = 0.3  # of a fingertip [kg]
_OSCILLATION_PER_STEP = 0.3  # natural frequency of a contact times the step [rad]
_TYPICAL_FORCE = 20.0  # normal force at which ``similar`` is half critically damped [N]
_STICTION_SPEED = 1e-6  # below which friction is viscous in ``similar`` [m/s]
_ROUGH = 1e9  # Drake combines friction as 2 a b / (a + b), which is 2 a where b is this


def replay_in_drake(result: RunResult, step: float, approximation: str = "sap") -> Replay:
    """Plays the torques of a run into Drake.

    Args:
        result: A run that starts from rest, densely stored.
        step: Drake's time step [s].
        approximation: One of `APPROXIMATIONS`.
    """
    from pydrake.systems.analysis import Simulator

    scenario, trace = result.scenario, result.trace
    diagram, plant, joints, tips = _build(scenario, trace.joint_position[0], step, approximation)
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    body = plant.GetJointByName("object")
    for joint, angle in zip(joints, trace.joint_position[0], strict=True):
        joint.set_angle(context, angle)
    body.set_pose(context, trace.object_pose[0, :2], trace.object_pose[0, 2])
    port = plant.get_applied_generalized_force_input_port()
    places = [joint.velocity_start() for joint in joints]
    forces, poses, slips = np.zeros(plant.num_velocities()), [], []
    for k, torques in enumerate(mean_torques(result, step)):
        forces[places] = torques
        port.FixValue(context, forces)
        simulator.AdvanceTo((k + 1) * step)
        poses.append(np.array([*body.get_translation(context), body.get_rotation(context)]))
        points = [tip.CalcPoseInWorld(context).translation()[:2] for tip in tips]
        slips.append(slip_of(scenario, poses[-1], np.array(points)))
    times = np.linspace(step, step * len(poses), len(poses))
    return Replay(times, np.array(poses), np.array(slips))


def measure_differences(
    name: str,
    steps: Sequence[float] = STEPS,
    duration: float = DURATION,
    approximation: str = "sap",
) -> list[Differences]:
    """The table of differences of a preset: one row per step of Drake."""
    result = record_case(name, duration)
    return [compare(result, replay_in_drake(result, step, approximation), step) for step in steps]


def _build(
    scenario: Scenario, angles: Floats, step: float, approximation: str
) -> tuple[Any, Any, list[Any], list[Any]]:
    """Diagram, plant, finger joints and fingertip frames."""
    from pydrake.multibody import plant as multibody
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    plant, _ = multibody.AddMultibodyPlantSceneGraph(builder, step)
    kind = getattr(multibody.DiscreteContactApproximation, APPROXIMATIONS[approximation])
    plant.set_discrete_contact_approximation(kind)
    plant.set_contact_model(multibody.ContactModel.kPoint)
    plant.set_stiction_tolerance(_STICTION_SPEED)
    plant.mutable_gravity_field().set_gravity_vector([0.0, -scenario.simulation.gravity, 0.0])
    joints, tips = [], []
    for i, finger in enumerate(scenario.fingers):
        first, second, tip = _add_finger(plant, finger, f"finger{i}")
        inward = _inward_normal(scenario, finger, float(angles[2 * i] + angles[2 * i + 1]))
        _add_sphere(plant, tip, inward, _material(finger.friction / 2.0, step))
        joints += [first, second]
        tips.append(tip)
    _add_object(plant, scenario, _material(_ROUGH, step))
    plant.Finalize()
    return builder.Build(), plant, joints, tips


def _inward_normal(scenario: Scenario, finger: FingerParameters, angle: float) -> Floats:
    """Inward normal of the finger's face at the start, in the frame of the last link."""
    turn = scenario.trajectory.start[2] - angle
    rotation = np.array(
        [[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]], dtype=np.float64
    )
    return rotation @ np.array(contact_frame(scenario.object, finger).normal)


def _add_finger(plant: Any, finger: FingerParameters, name: str) -> tuple[Any, Any, Any]:
    """Both joints of a finger and the frame at its tip."""
    from pydrake.math import RigidTransform
    from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint

    frame, place, joints = plant.world_frame(), np.array([*finger.base, 0.0]), []
    for k, length in enumerate(finger.link_lengths):
        turn = finger.link_inertia_fractions[k] * length**2
        centre = finger.link_centre_fractions[k] * length
        link = _add_body(plant, f"{name}-link{k}", finger.link_masses[k], centre, turn)
        at = plant.AddFrame(FixedOffsetFrame(f"{name}-joint{k}", frame, RigidTransform(place)))
        joint = RevoluteJoint(f"{name}-{k}", at, link.body_frame(), np.array([0.0, 0.0, 1.0]))
        joints.append(plant.AddJoint(joint))
        frame, place = link.body_frame(), np.array([length, 0.0, 0.0])
    tip = plant.AddFrame(FixedOffsetFrame(f"{name}-tip", frame, RigidTransform(place)))
    return joints[0], joints[1], tip


def _add_body(plant: Any, name: str, mass: float, centre: float, gyration: float) -> Any:
    from pydrake.multibody.tree import RotationalInertia, SpatialInertia

    turn = RotationalInertia(mass * gyration, mass * gyration, mass * gyration)
    inertia = SpatialInertia.MakeFromCentralInertia(mass, np.array([centre, 0.0, 0.0]), turn)
    return plant.AddRigidBody(name, inertia)


def _add_sphere(plant: Any, tip: Any, inward: Floats, material: Any) -> None:
    """A sphere that touches the face exactly at the end of the link."""
    from pydrake.geometry import Sphere
    from pydrake.math import RigidTransform

    shift = -_TIP_RADIUS * np.array([*inward, 0.0])
    pose = tip.GetFixedPoseInBodyFrame() @ RigidTransform(shift)
    name = f"{tip.name()}-sphere"
    plant.RegisterCollisionGeometry(tip.body(), pose, Sphere(_TIP_RADIUS), name, material)


def _add_object(plant: Any, scenario: Scenario, material: Any) -> None:
    from pydrake.geometry import Box
    from pydrake.math import RigidTransform
    from pydrake.multibody.tree import PlanarJoint

    size = scenario.object
    body = _add_body(plant, "object", size.mass, 0.0, size.inertia / size.mass)
    box = Box(2.0 * size.half_width, 2.0 * size.face_half_length, 2.0 * size.half_width)
    plant.RegisterCollisionGeometry(body, RigidTransform(), box, "box", material)
    plant.AddJoint(PlanarJoint("object", plant.world_frame(), body.body_frame()))


def _material(friction: float, step: float) -> Any:
    """A contact whose compliance falls with the square of the step, as in MuJoCo's scene.

    Both bodies carry twice the stiffness, which is in series; ``similar`` takes the
    dissipation, ``sap`` the relaxation time.
    """
    from pydrake.geometry import AddContactMaterial, ProximityProperties
    from pydrake.multibody.plant import CoulombFriction

    frequency = _OSCILLATION_PER_STEP / step
    material = ProximityProperties()
    AddContactMaterial(
        material,
        dissipation=_APPARENT_MASS * frequency / _TYPICAL_FORCE,
        point_stiffness=2.0 * _APPARENT_MASS * frequency**2,
        friction=CoulombFriction(friction, friction),
    )
    material.AddProperty("material", "relaxation_time", 1.0 / frequency)
    return material


def main() -> None:
    """Prints the differences of both cases."""
    for name in CASES:
        for approximation in APPROXIMATIONS:
            rows = measure_differences(name, approximation=approximation)
            print(format_table(f"{name} in Drake ({approximation}), {DURATION} s", rows))


if __name__ == "__main__":
    main()
