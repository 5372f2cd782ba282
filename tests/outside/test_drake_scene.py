"""``slipgrasp scene --format drake``: Drake opens the file and reproduces the expected result."""

import numpy as np
import pytest

from benchmarks.drake_replay import build
from tests.outside.scenes import ON_SLIDES, SHOWN, largest_error, slip, smoother, write

pytest.importorskip("pydrake")

pytestmark = pytest.mark.slow


def play(path, answer):
    """Slips of Drake at the end of every step."""
    from pydrake.systems.analysis import Simulator

    assert answer["plant"]["time_step"] == answer["step"]
    diagram, plant = build(path.read_text(encoding="utf-8"), answer)
    simulator = Simulator(diagram)
    root = simulator.get_mutable_context()
    context = plant.GetMyMutableContextFromRoot(root)
    body, slips, changes = plant.GetBodyByName("object"), [], list(answer["friction_changes"])
    tips = [plant.GetFrameByName(contact["site"]) for contact in answer["contacts"]]
    for k, torques in enumerate(answer["torques"]):
        while changes and changes[0]["time"] < (k + 0.5) * answer["step"]:
            change_friction(diagram, plant, root, **changes.pop(0))
        plant.get_actuation_input_port().FixValue(context, np.array(torques))
        simulator.AdvanceTo((k + 1) * answer["step"])
        pose = body.EvalPoseInWorld(context)
        points = [tip.CalcPoseInWorld(context).translation() for tip in tips]
        turn = pose.rotation().matrix()
        slips.append(slip(answer["contacts"], points, pose.translation(), turn))
    return slips


def change_friction(diagram, plant, root, time, contact, friction):
    """Replaces the friction of a fingertip; of two coefficients Drake takes 2 a b / (a + b)."""
    from pydrake.geometry import ProximityProperties, RoleAssign
    from pydrake.multibody.plant import CoulombFriction

    graph = diagram.GetSubsystemByName("scene_graph")
    (sphere,) = plant.GetCollisionGeometriesForBody(plant.GetFrameByName(f"tip{contact}").body())
    properties = ProximityProperties(graph.model_inspector().GetProximityProperties(sphere))
    half = 0.5 * friction
    properties.UpdateProperty("material", "coulomb_friction", CoulombFriction(half, half))
    graph.AssignRole(
        graph.GetMyMutableContextFromRoot(root),
        plant.get_source_id(),
        sphere,
        properties,
        RoleAssign.kReplace,
    )


def check(path, answer):
    assert largest_error(play(path, answer), answer) < answer["tolerance"]["slip"]


@pytest.mark.parametrize("preset", SHOWN[::3])
def test_drake_reproduces_the_expected_slips_within_the_tolerance(tmp_path, preset):
    check(*write(tmp_path, preset, "drake"))


@pytest.mark.parametrize("preset", ON_SLIDES)
def test_drake_plays_fingers_on_slides(tmp_path, preset):
    check(*write(tmp_path, preset, "drake", assignments=ON_SLIDES[preset]))


@pytest.mark.parametrize("preset", ["gripper-lift", "composite-case-2"])
def test_drake_plays_a_change_of_friction(tmp_path, preset):
    path, answer = write(tmp_path, smoother(tmp_path, preset), "drake")
    check(path, answer)
    # The change matters: without it the slips are others.
    unchanged = play(path, {**answer, "friction_changes": []})
    assert largest_error(unchanged, answer) > answer["tolerance"]["slip"]


@pytest.mark.parametrize(("preset", "free"), [("paper-case-1", 3), ("spatial-box", 7)])
def test_drake_opens_the_file_with_a_motor_per_joint_of_the_hand(tmp_path, preset, free):
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant

    path, answer = write(tmp_path, preset, "drake", suffix="sdf")
    plant = MultibodyPlant(answer["step"])
    Parser(plant).AddModels(str(path))
    plant.Finalize()
    motors = [plant.get_joint_actuator(k).joint().name() for k in plant.GetJointActuatorIndices()]
    joints = len(answer["torques"][0])
    per_finger = joints // len(answer["contacts"])
    assert motors == [f"q{k // per_finger}{k % per_finger}" for k in range(joints)]
    assert plant.num_positions() == joints + free
