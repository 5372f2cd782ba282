"""Random chains of two joints in the plane against Pinocchio."""

from random import Random

import numpy as np
import pinocchio
import pytest

from slipgrasp.core.kernel.planar import chain, dynamics, kinematics
from slipgrasp.core.kernel.planar.packing import make_table, pack_model, whole_faces
from slipgrasp.core.scenario.geometry import planar_tip_at_start
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.scenario.planar_chain import planar_chain_start
from tests.core.drawn_chains import with_chains
from tests.each_case import each_case
from tests.state_evaluation import from_python

pytestmark = pytest.mark.slow

NUM_CHAINS, TOLERANCE, GRAVITY = 100, 1e-12, 9.81
ALIGNED = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED

solve_finger = from_python(kinematics.solve_finger)
joint_space = from_python(dynamics.joint_space)
chain_position = from_python(chain.chain_position)
chain_weight = from_python(chain.chain_weight)
posture_of = from_python(kinematics.posture_of)


def turned(angle, place):
    return pinocchio.SE3(pinocchio.utils.rotate("z", angle), np.array([*place, 0.0]))


def as_model(finger):
    """The chain as a model of Pinocchio, and the frame of its tip."""
    model, parent = pinocchio.Model(), 0
    model.gravity.linear = np.array([0.0, -GRAVITY, 0.0])
    place = turned(finger.attitude, (0.0, 0.0))
    for k, joint in enumerate(finger.joints):
        axis = np.array([*joint.axis, 0.0])
        slide = pinocchio.JointModelPrismaticUnaligned(axis / np.linalg.norm(axis))
        kind = pinocchio.JointModelRZ() if joint.kind == "revolute" else slide
        here = place * turned(joint.attitude, joint.place)
        parent, place = model.addJoint(parent, kind, here, f"joint {k}"), pinocchio.SE3.Identity()
        inertia = joint.mass * joint.unit_inertia * np.eye(3)
        body = pinocchio.Inertia(joint.mass, np.array([*joint.centre, 0.0]), inertia)
        model.appendBodyToJoint(parent, body, place)
    tip = pinocchio.Frame("tip", parent, turned(0.0, finger.tip), pinocchio.FrameType.OP_FRAME)
    return model, model.addFrame(tip)


@each_case("seed", range(NUM_CHAINS))
def test_a_random_planar_chain_moves_as_in_pinocchio(seed):
    scenario = with_chains(load_scenario("paper-case-1"), seed, 1.0)
    constants = pack_model(make_table(scenario), whole_faces())
    rng, hand = Random(seed), constants.hand
    for i, finger in enumerate(scenario.fingers):
        target = planar_tip_at_start(scenario, i)
        vx, vy = rng.gauss(0.0, 1.0), rng.gauss(0.0, 1.0)
        ours = solve_finger(hand, i, *target, vx, vy)
        pose = posture_of(ours)
        q = np.array([chain_position(hand.chains[i], pose, k) for k in range(2)])
        start = planar_chain_start(finger, target)
        assert_close(q, start.positions)
        assert np.abs(q - finger.posture).max() < 0.2 + TOLERANCE
        model, tip = as_model(finger)
        data, rates = model.createData(), np.array([ours.rate1, ours.rate2])
        pinocchio.forwardKinematics(model, data, q, rates, np.zeros(2))
        pinocchio.updateFramePlacements(model, data)
        assert_close(data.oMf[tip].translation[:2], target)
        jacobian = pinocchio.computeFrameJacobian(model, data, q, tip, ALIGNED)[:2].copy()
        inverse = [[ours.inverse00, ours.inverse01], [ours.inverse10, ours.inverse11]]
        assert_close(jacobian @ inverse, np.eye(2))
        assert_close(jacobian @ rates, [vx, vy])
        sizes = np.linalg.norm(jacobian, axis=0)
        if {joint.kind for joint in finger.joints} == {"revolute"}:
            sizes = np.hypot(*finger.joints[1].place), np.hypot(*finger.tip)  # of the links
        sine = np.linalg.det(jacobian) / np.prod(sizes)
        assert_close([ours.extension], [min(sine**2 - 1e-4, *limits_left(finger, q))])
        drift = pinocchio.getFrameClassicalAcceleration(model, data, tip, ALIGNED).linear[:2]
        assert_close([-ours.bias_x, -ours.bias_y], drift)
        masses = constants.truth.link_masses
        m11, m12, m22, h1, h2 = joint_space(hand, masses, i, ours)
        inertia = np.triu(pinocchio.crba(model, data, q))
        assert_close([m11, m12, m22], inertia[np.triu_indices(2)])
        assert_close([h1, h2], pinocchio.nonLinearEffects(model, data, q, rates))
        weight = pinocchio.computeGeneralizedGravity(model, data, q)
        assert_close(chain_weight(hand.chains[i], masses[i], pose, GRAVITY), weight)


def limits_left(finger, q):
    for joint, value in zip(finger.joints, q, strict=True):
        if joint.minimum is not None:
            yield value - joint.minimum
            yield joint.maximum - value
    yield np.inf


def assert_close(ours, theirs):
    theirs = np.asarray(theirs)
    tolerance = TOLERANCE * (1.0 + np.abs(theirs).max())
    np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=tolerance)
