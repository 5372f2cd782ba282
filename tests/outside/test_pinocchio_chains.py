"""Chains of random joints against Pinocchio: both read them from one URDF file."""

from typing import NamedTuple

import numpy as np
import pinocchio
import pytest

from slipgrasp.core.kernel.compilation.records import make_record
from slipgrasp.core.kernel.spatial import chain, chain_dynamics
from slipgrasp.core.kernel.spatial.chain_packing import pack_chain
from slipgrasp.core.scenario.hand_files.description import Description
from slipgrasp.core.scenario.hand_files.urdf import read_urdf
from slipgrasp.core.scenario.spatial import SpatialFinger
from tests.each_case import each_case
from tests.state_evaluation import from_python

pytestmark = pytest.mark.slow

GRAVITY, NUM_CHAINS, TOLERANCE = 9.81, 60, 1e-12
KINDS = ("revolute", "prismatic", "continuous")
UPPER = np.triu_indices(3)
ALIGNED = pinocchio.ReferenceFrame.LOCAL_WORLD_ALIGNED

place_chain = from_python(chain.place_chain)
move_chain = from_python(chain.move_chain)
weigh_chain = from_python(chain_dynamics.weigh_chain)
chain_weight = from_python(chain_dynamics.chain_weight)
chain_turning = from_python(chain.chain_turning)
moment_at_chain = from_python(chain_dynamics.moment_at_chain)
see_at_tip = from_python(chain_dynamics.see_at_tip)


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


def random_joint(rng, name, kind, parent, child, follows=None):
    axis = rng.normal(size=3)
    mimic = ""
    if follows is not None:
        leader, ratio, offset = follows
        mimic = f'<mimic joint="{leader}" multiplier="{ratio!r}" offset="{offset!r}"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{written(rng.normal(size=3))}" rpy="{written(rng.uniform(-3, 3, 3))}"/>'
        f'<axis xyz="{written(axis / np.linalg.norm(axis))}"/>'
        f'<limit lower="-3" upper="3" effort="1" velocity="1"/>{mimic}</joint>'
    )


class Hand(NamedTuple):
    """A finger as a file, and how all its moving joints follow three of them: q = A c + b."""

    text: str
    coupling: tuple[np.ndarray, np.ndarray]


def random_hand(rng, followers=0):
    """Moving joints with fixed ones between them, and a link fixed beside the last.

    Three joints move by themselves; others follow them, or each other, before or behind them.
    """
    count = 3 + followers
    own = sorted(rng.choice(count, 3, replace=False).tolist())
    ratios, offsets = np.zeros((count, 3)), np.zeros(count)
    ratios[own] = np.eye(3)
    parts, before, known = ['<link name="base"/>'], "base", list(own)
    coupled = {}
    for k in rng.permutation([k for k in range(count) if k not in own]).tolist():
        leader, ratio, offset = int(rng.choice(known)), *rng.uniform(-1.5, 1.5, 2).tolist()
        coupled[k] = f"j_moving_{leader}", ratio, offset
        ratios[k], offsets[k] = ratio * ratios[leader], ratio * offsets[leader] + offset
        known.append(k)
    for k in range(count):
        for name, kind in ((f"moving_{k}", str(rng.choice(KINDS[:2]))), (f"fixed_{k}", "fixed")):
            follows = coupled.get(k) if kind != "fixed" else None
            parts += [
                random_link(rng, name),
                random_joint(rng, f"j_{name}", kind, before, name, follows),
            ]
            before = name
    parts += [random_link(rng, "beside"), random_joint(rng, "b", "fixed", before, "beside")]
    parts += ['<link name="tip"/>', random_joint(rng, "t", "fixed", before, "tip")]
    return Hand(f'<robot name="random">{"".join(parts)}</robot>', (ratios, offsets))


class Terms(NamedTuple):
    """Equations of one finger, and its tip."""

    inertia: np.ndarray
    bias: np.ndarray
    tip: np.ndarray
    jacobian: np.ndarray
    curvature: np.ndarray
    turning: np.ndarray  # angular velocity of the tip and its rate


class Forces(NamedTuple):
    """What the joints need, in coordinates."""

    weight: np.ndarray  # torques that carry the links at rest
    angular: np.ndarray  # angular Jacobian


class Finger(NamedTuple):
    """A chain as the kernel has it."""

    constants: np.void
    now: np.void
    masses: np.ndarray


def by_kernel(read, q, rates):
    """A finger that was read from a file, at coordinates and their rates."""
    finger = SpatialFinger(
        kind="chain", base=(0.0, 0.0, 0.0), face="top", joints=read.joints, tip=read.tip
    )
    constants, now = make_record(chain.CHAIN), make_record(chain.CHAIN_STATE)
    masses, curvature = np.zeros(chain.MAX_LINKS), np.zeros(3)
    pack_chain(finger, constants, masses)
    place_chain(constants, q, now, False)
    move_chain(constants, rates, now, curvature)
    weigh_chain(constants, masses, GRAVITY, now)
    terms = Terms(
        inertia=symmetric(now.inertia),
        bias=now.bias.copy(),
        tip=now.tip.copy(),
        jacobian=now.jacobian.copy(),
        curvature=curvature,
        turning=np.array(chain_turning(constants, now)),
    )
    return Finger(constants, now, masses), terms


def symmetric(entries):
    full = np.zeros((3, 3))
    full[UPPER] = entries
    return np.triu(full) + np.triu(full, 1).T


def by_pinocchio(model, name, coupling, coordinates, coordinate_rates):
    """A model of which all joints move by themselves, coupled here.

    Args:
        model: The model.
        name: Of the link whose origin is the tip.
        coupling: A and b of all its joints.
        coordinates: Of those that do.
        coordinate_rates: Their rates.
    """
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
    data, tip, (a, b) = model.createData(), model.getFrameId(name), coupling
    q, rates = a @ coordinates + b, a @ coordinate_rates
    inertia = np.triu(pinocchio.crba(model, data, q))
    inertia += np.triu(inertia, 1).T
    bias = pinocchio.nonLinearEffects(model, data, q, rates).copy()
    jacobian = pinocchio.computeFrameJacobian(model, data, q, tip, ALIGNED).copy()
    pinocchio.forwardKinematics(model, data, q, rates, np.zeros(len(q)))
    pinocchio.updateFramePlacements(model, data)
    curvature = pinocchio.getFrameClassicalAcceleration(model, data, tip, ALIGNED)
    weight = pinocchio.computeGeneralizedGravity(model, data, q)
    return Forces(a.T @ weight, jacobian[3:] @ a), Terms(
        inertia=a.T @ inertia @ a,
        bias=a.T @ bias,
        tip=data.oMf[tip].translation.copy(),
        jacobian=jacobian[:3] @ a,
        curvature=curvature.linear.copy(),
        turning=np.concatenate([jacobian[3:] @ rates, curvature.angular]),
    )


def assert_same(ours, theirs):
    for name, a, b in zip(Terms._fields, ours, theirs, strict=True):
        np.testing.assert_allclose(a, b, atol=TOLERANCE * (1.0 + np.abs(b).max()), err_msg=name)


@pytest.mark.parametrize("followers", range(chain.MAX_LINKS - 2))
@each_case("seed", range(NUM_CHAINS))
def test_a_random_chain_moves_as_in_pinocchio(seed, followers):
    rng = np.random.default_rng([seed, followers])
    hand, q, rates = random_hand(rng, followers), rng.uniform(-2.0, 2.0, 3), rng.normal(size=3)
    finger, ours = by_kernel(Description(*read_urdf(hand.text)).finger("tip"), q, rates)
    model = pinocchio.buildModelFromXML(hand.text)
    forces, theirs = by_pinocchio(model, "tip", hand.coupling, q, rates)
    assert_same(ours, theirs)
    if np.linalg.cond(theirs.jacobian) < 100.0:
        assert_seen_at_tip(finger, forces, theirs, rng.normal(size=3))


def assert_seen_at_tip(finger, forces, theirs, moment):
    """Lambda, f_0, and what carries a moment on the last link or the weight, as tip forces."""
    constants, now, masses = finger
    inverse = np.linalg.inv(theirs.jacobian)
    wanted = inverse.T @ theirs.inertia @ inverse
    tip_inertia, tip_bias = np.zeros(6), np.zeros(3)
    see_at_tip(now.inverse, now.inertia, now.bias, theirs.curvature, tip_inertia, tip_bias)
    np.testing.assert_allclose(tip_inertia, wanted[UPPER], atol=1e-9 * np.abs(wanted).max())
    for ours, torques in (
        (tip_bias, theirs.bias - theirs.jacobian.T @ wanted @ theirs.curvature),
        (moment_at_chain(constants, now, *moment), forces.angular.T @ moment),
        (chain_weight(constants, masses, GRAVITY, now), forces.weight),
    ):
        force = inverse.T @ torques
        np.testing.assert_allclose(ours, force, atol=1e-9 * (1.0 + np.abs(force).max()))
