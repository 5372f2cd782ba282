"""`python -m benchmarks.drake_replay`: torques in Drake, finer steps and stiffer contacts.

Drake is not in the extra `test`: run `pip install drake` first. It is imported only when a replay
starts. Its SAP solver has several convex approximations of a contact. With ``sap``, sliding bodies
have a gap of mu times speed times relaxation time, which exceeds the compression of our contacts
during fast slip in case II: there its slip stops converging at 50 um. With ``similar`` the gap is
smaller.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.replay import Replay, print_differences, slips_of
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario import Scenario
from slipgrasp.core.scenario.space import SPATIAL
from slipgrasp.recordings.engines.bodies import OBJECT, contacts_of
from slipgrasp.recordings.engines.expected import mean_torques
from slipgrasp.recordings.engines.sdf import describe_scene, settings

Floats = NDArray[np.float64]

APPROXIMATIONS = ("sap", "similar")


def replay_in_drake(result: RunResult, step: float, approximation: str = "sap") -> Replay:
    """Replays the torques of a run in Drake.

    Args:
        result: A run that starts from rest, densely stored.
        step: Drake's time step [s].
        approximation: One of `APPROXIMATIONS`.
    """
    from pydrake.systems.analysis import Simulator

    scenario, contacts = result.scenario, contacts_of(result.scenario)
    text = describe_scene(scenario, result.trace.joint_position[0], step)
    diagram, plant = build(text, settings(scenario, step, approximation))
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    port, body = plant.get_actuation_input_port(), plant.GetBodyByName(OBJECT)
    tips = [plant.GetFrameByName(contact["site"]) for contact in contacts]
    poses, slips = [], []
    for k, torques in enumerate(mean_torques(result, step)):
        port.FixValue(context, torques)
        simulator.AdvanceTo((k + 1) * step)
        pose = body.EvalPoseInWorld(context)
        poses.append(_coordinates(scenario, pose))
        places = (tip.CalcPoseInWorld(context).translation() for tip in tips)
        turn = pose.rotation().matrix()
        slips.append(slips_of(contacts, pose.translation(), turn, places))
    return Replay.at_steps(step, poses, slips)


def build(text: str, given: dict[str, Any]) -> tuple[Any, Any]:
    """Diagram and plant of a scene.

    Args:
        text: The scene in SDFormat.
        given: Settings of the plant, as in the file of the expected motion.
    """
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlantConfig
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(MultibodyPlantConfig(**given["plant"]), builder)
    plant.mutable_gravity_field().set_gravity_vector(given["gravity"])
    Parser(plant).AddModelsFromString(text, "sdf")
    plant.Finalize()
    return builder.Build(), plant


def _coordinates(scenario: Scenario, pose: Any) -> Floats:
    """Our coordinates of the object's pose."""
    place, turn = pose.translation(), pose.rotation().matrix()
    if scenario.space is not SPATIAL:
        return np.array([place[0], place[2], math.atan2(turn[2, 0], turn[0, 0])])
    quaternion = pose.rotation().ToQuaternion().wxyz()
    sign = math.copysign(1.0, quaternion @ scenario.trajectory.start[3:])
    return np.array([*place, *(sign * quaternion)])


if __name__ == "__main__":
    for kind in APPROXIMATIONS:
        print_differences(f"Drake ({kind})", partial(replay_in_drake, approximation=kind))
