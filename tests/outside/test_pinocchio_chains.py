"""Chains of random joints against Pinocchio: both read them from one URDF file."""

from typing import NamedTuple

import numpy as np
import pinocchio
import pytest

from slipgrasp.core.kernel.compilation.records import make_record
from slipgrasp.core.kernel.spatial import chain
from slipgrasp.core.kernel.spatial.model import pack_chain
from slipgrasp.core.scenario.spatial import SpatialFinger
from slipgrasp.core.scenario.urdf import Description
from tests.state_evaluation import from_python

pytestmark = pytest.mark.slow

GRAVITY, NUM_CHAINS, TOLERANCE = 9.81, 60, 1e-12
KINDS = ("revolute", "prismatic", "continuous")
UPPER = np.triu_indices(3)
ALIGNED = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED

place_chain = from_python(chain.place_chain)
move_chain = from_python(chain.move_chain)
add_links = from_python(chain.add_links)
see_at_tip = from_python(chain.see_at_tip)


def written(vector):
    return " ".join(repr(float(part)) for part in vector)


def random_link(rng, name):
    spread = rng.normal(size=(3, 3))
    inertia = spread @ spread.T + 0.2 * np.eye(3)
    inertia = np.trace(inertia) * np.eye(3) - inertia  # of some body
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    entries = " ".join(f'{n}="{v!r}"' for n, v in zip(names, inertia[UPPER].tolist(), strict=True))
    return (
        f'<link name="{name}"><inertial><mass value="{rng.uniform(0.2, 2.0)!r}"/>'
        f'<origin xyz="{written(rng.normal(size=3))}" rpy="{written(rng.uniform(-3, 3, 3))}"/>'
        f"<inertia {entries}/></inertial></link>"
    )


def random_joint(rng, name, kind, parent, child):
    axis = rng.normal(size=3)
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{written(rng.normal(size=3))}" rpy="{written(rng.uniform(-3, 3, 3))}"/>'
        f'<axis xyz="{written(axis / np.linalg.norm(axis))}"/>'
        '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
    )


def random_hand(rng):
    """Three moving joints with fixed ones between them, and a link fixed beside the last."""
    parts, before = ['<link name="base"/>'], "base"
    for k in range(3):
        for name, kind in ((f"moving_{k}", str(rng.choice(KINDS[:2]))), (f"fixed_{k}", "fixed")):
            parts += [random_link(rng, name), random_joint(rng, f"j_{name}", kind, before, name)]
            before = name
    parts += [random_link(rng, "beside"), random_joint(rng, "b", "fixed", before, "beside")]
    parts += ['<link name="tip"/>', random_joint(rng, "t", "fixed", before, "tip")]
    return f'<robot name="random">{"".join(parts)}</robot>'


class Terms(NamedTuple):
    """Equations of one finger, and its tip."""

    inertia: np.ndarray
    bias: np.ndarray
    tip: np.ndarray
    jacobian: np.ndarray
    curvature: np.ndarray


def by_kernel(text, q, rates):
    read = Description(text).finger("tip")
    finger = SpatialFinger(
        kind="chain", base=(0.0, 0.0, 0.0), face="top", joints=read.joints, tip=read.tip
    )
    constants, now = make_record(chain.CHAIN), make_record(chain.CHAIN_STATE)
    masses, curvature = np.zeros(3), np.zeros(3)
    pack_chain(finger, constants, masses)
    place_chain(constants, q, now)
    move_chain(constants, GRAVITY, rates, now, curvature)
    add_links(masses, now)
    inertia = np.zeros((3, 3))
    inertia[UPPER] = now.inertia
    inertia = np.triu(inertia) + np.triu(inertia, 1).T
    terms = Terms(inertia, now.bias.copy(), now.tip.copy(), now.jacobian.copy(), curvature)
    return terms, now


def by_pinocchio(text, q, rates):
    model = pinocchio.buildModelFromXML(text)
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    data, tip = model.createData(), model.getFrameId("tip")
    inertia = pinocchio.crba(model, data, q).copy()
    bias = pinocchio.nonLinearEffects(model, data, q, rates).copy()
    jacobian = pinocchio.computeFrameJacobian(model, data, q, tip, ALIGNED)[:3].copy()
    pinocchio.forwardKinematics(model, data, q, rates, np.zeros(3))
    pinocchio.updateFramePlacements(model, data)
    curvature = pinocchio.getFrameClassicalAcceleration(model, data, tip, ALIGNED).linear
    inertia = np.triu(inertia) + np.triu(inertia, 1).T
    return Terms(inertia, bias, data.oMf[tip].translation.copy(), jacobian, curvature.copy())


@pytest.mark.parametrize("seed", range(NUM_CHAINS))
def test_a_random_chain_moves_as_in_pinocchio(seed):
    rng = np.random.default_rng(seed)
    text, q, rates = random_hand(rng), rng.uniform(-2.0, 2.0, 3), rng.normal(size=3)
    (ours, now), theirs = by_kernel(text, q, rates), by_pinocchio(text, q, rates)
    for name, a, b in zip(Terms._fields, ours, theirs, strict=True):
        np.testing.assert_allclose(a, b, atol=TOLERANCE * (1.0 + np.abs(b).max()), err_msg=name)
    inertia, bias, _, jacobian, curvature = theirs
    if np.linalg.cond(jacobian) < 100.0:
        inverse = np.linalg.inv(jacobian)
        wanted = inverse.T @ inertia @ inverse
        tip_inertia, tip_bias = np.zeros(6), np.zeros(3)
        see_at_tip(now.inverse, now.inertia, now.bias, curvature, tip_inertia, tip_bias)
        np.testing.assert_allclose(tip_inertia, wanted[UPPER], atol=1e-9 * np.abs(wanted).max())
        force = inverse.T @ bias - wanted @ curvature
        np.testing.assert_allclose(tip_bias, force, atol=1e-9 * (1.0 + np.abs(force).max()))
