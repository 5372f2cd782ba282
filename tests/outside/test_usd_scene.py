"""``slipgrasp scene --format usd``: the stage is valid, and equal to the scene for MuJoCo.

No engine simulates it here: this checks the file.
"""

import mujoco
import numpy as np
import pytest

from slipgrasp.core.scenario.loading import load_scenario
from tests.outside.scenes import smoother, write

pytest.importorskip("pxr")

from pxr import Usd, UsdGeom, UsdPhysics, UsdShade, UsdValidation

PRESETS = ["paper-case-1", "three-fingers", "spatial-box", "spatial-prism", "gripper-lift"]


@pytest.fixture(params=PRESETS)
def preset(request):
    return request.param


@pytest.fixture
def stage(preset, tmp_path):
    path, answer = write(tmp_path, preset, "usd", suffix="usda")
    assert "tolerance" not in answer
    return Usd.Stage.Open(str(path))


@pytest.fixture
def scene(preset, tmp_path):
    """The same scene in MuJoCo, in its start pose."""
    (folder := tmp_path / "mjcf").mkdir()
    model = mujoco.MjModel.from_xml_path(str(write(folder, preset, "mjcf")[0]))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_kinematics(model, data)
    return model, data


def prims(stage, schema):
    found = [prim for prim in stage.Traverse() if prim.HasAPI(schema) or prim.IsA(schema)]
    return {prim.GetName(): prim for prim in found}


def pose(prim):
    """Matrix whose columns are scaled axes, and position, in the world."""
    matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0.0)).T
    return matrix[:3, :3], matrix[:3, 3]


def test_usd_finds_no_error_in_the_stage(stage):
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert "usdPhysicsValidators:PhysicsJointChecker" in {
        each.GetMetadata().name for each in validators
    }
    assert UsdValidation.ValidationContext(validators).Validate(stage) == []


def test_units_and_gravity_are_those_of_the_scenario(stage, preset):
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert UsdPhysics.GetStageKilogramsPerUnit(stage) == 1.0
    (world,) = prims(stage, UsdPhysics.Scene).values()
    gravity = UsdPhysics.Scene(world)
    assert tuple(gravity.GetGravityDirectionAttr().Get()) == (0.0, 0.0, -1.0)
    expected = load_scenario(preset).simulation.gravity
    assert gravity.GetGravityMagnitudeAttr().Get() == pytest.approx(expected)


def test_bodies_have_the_poses_and_masses_of_mujoco_s_scene(stage, scene):
    model, data = scene
    bodies = prims(stage, UsdPhysics.RigidBodyAPI)
    for index in range(1, model.nbody):
        prim = bodies.pop(model.body(index).name)
        turn, place = pose(prim)
        np.testing.assert_allclose(turn, data.xmat[index].reshape(3, 3), atol=1e-12)
        np.testing.assert_allclose(place, data.xpos[index], atol=1e-12)
        mass = UsdPhysics.MassAPI(prim)
        assert mass.GetMassAttr().Get() == pytest.approx(model.body_mass[index])
        np.testing.assert_allclose(mass.GetCenterOfMassAttr().Get(), model.body_ipos[index])
        inertias = np.sort(mass.GetDiagonalInertiaAttr().Get())
        np.testing.assert_allclose(inertias, np.sort(model.body_inertia[index]), rtol=1e-6)
    # The others connect two joints at one place.
    for prim in bodies.values():
        assert UsdPhysics.MassAPI(prim).GetMassAttr().Get() < 1e-8


def test_colliders_have_the_places_sizes_and_friction_of_mujoco_s_scene(stage, scene, preset):
    model, data = scene
    colliders = prims(stage, UsdPhysics.CollisionAPI)
    frictions = [finger.friction for finger in load_scenario(preset).fingers]
    assert set(colliders) == {model.geom(index).name for index in range(model.ngeom)}
    for name, prim in colliders.items():
        geom, (axes, place) = data.geom(name), pose(prim)
        sizes = model.geom(name).size
        np.testing.assert_allclose(place, geom.xpos, atol=1e-12)
        if prim.IsA(UsdGeom.Sphere):
            assert UsdGeom.Sphere(prim).GetRadiusAttr().Get() == sizes[0]
            friction = frictions[int(name.removeprefix("tip"))]
        else:
            assert UsdGeom.Cube(prim).GetSizeAttr().Get() == 2.0
            np.testing.assert_allclose(axes, geom.xmat.reshape(3, 3) * sizes, atol=1e-12)
            friction = max(frictions)
        binding = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial("physics")[0]
        material = UsdPhysics.MaterialAPI(binding.GetPrim())
        assert material.GetDynamicFrictionAttr().Get() == pytest.approx(friction)
        assert material.GetStaticFrictionAttr().Get() == pytest.approx(friction)


def test_joints_have_the_axes_of_mujoco_s_scene_seen_from_both_bodies(stage, scene):
    model, data = scene
    joints = prims(stage, UsdPhysics.Joint)
    assert set(joints) == {model.joint(k).name for k in range(model.njnt)} - {""}
    for name, prim in joints.items():
        kind = (
            UsdPhysics.RevoluteJoint if model.joint(name).type == 3 else UsdPhysics.PrismaticJoint
        )
        assert prim.IsA(kind)
        along = np.eye(3)["XYZ".index(kind(prim).GetAxisAttr().Get())]
        joint, places = UsdPhysics.Joint(prim), []
        for body, position, rotation in (
            (joint.GetBody0Rel(), joint.GetLocalPos0Attr(), joint.GetLocalRot0Attr()),
            (joint.GetBody1Rel(), joint.GetLocalPos1Attr(), joint.GetLocalRot1Attr()),
        ):
            targets = body.GetTargets()
            turn, place = pose(stage.GetPrimAtPath(targets[0])) if targets else (np.eye(3), 0.0)
            axis = turn @ np.array(rotation.Get().Transform(tuple(along)))
            np.testing.assert_allclose(axis, data.joint(name).xaxis, atol=1e-6)
            places.append(place + turn @ np.array(position.Get()))
        # Along the axis of a slide the second body has moved by the joint's position.
        moved = data.joint(name).qpos if kind is UsdPhysics.PrismaticJoint else 0.0
        np.testing.assert_allclose(places[1], places[0] + moved * axis, atol=1e-6)


def test_changes_of_friction_are_in_the_answer(tmp_path):
    _, answer = write(tmp_path, smoother(tmp_path, "composite-case-2"), "usd")
    assert answer["friction_changes"] == [{"time": 0.1, "contact": 0, "friction": 0.15}]
