"""Runs of the reference in space: figures of two other implementations, symmetries, energy.

The figures were printed by two prototypes before this reference was written (`EXPECTED`); the
planar ones are those of the paper's cases sampled at 1 ms. Longer runs:
``python -m tests.references.spatial_figures s1 7``.
"""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.references.spatial_cases import hand_of, prism_hand, s1, s3
from tests.references.spatial_figures import CASES
from tests.references.spatial_run import Simulator

pytestmark = pytest.mark.slow


# Duration [s], slip ends [ms], slip paths [mm], final (s_x, s_y) [mm]; None where not printed.
EXPECTED = {
    "s1-pyramid": (
        0.093,
        ["91.110", "83.312", "76.226"],
        ["2.9261", "2.2363", "1.6413"],
        [(None, "0.000")] * 3,
    ),
    "s2": (0.11, ["107.805"] * 3, ["40.099"] * 3, [("40.099", "0.000")] * 3),
    "s3h": (
        0.009,
        ["6.475", "3.129", "7.073"],
        ["0.0294", "0.0144", "0.0358"],
        [("0.0281", "-0.0075"), ("0.0141", "0.0020"), ("0.0358", "0.0002")],
    ),
    "planar-1": (
        0.089,
        ["87.983946", "85.454700"],
        ["2.6720528", "2.2098970"],
        [(None, "0.000")] * 2,
    ),
    "planar-2": (0.114, ["112.19", "112.19"], ["47.510"] * 2, [(None, "0.000")] * 2),
}


# What is left of a zero [m], [rad]; NumPy's sums are rounded as each processor likes.
ROUNDING = 1e-12


@cache
def run_of(case):
    world = CASES[case]()._replace(tolerance=1e-8)
    return Simulator(world, (0.05,)).simulate(EXPECTED[case][0])


def printed_alike(value, text):
    """Whether a value rounds to what is printed."""
    places = len(text.partition(".")[2])
    return text is None or f"{value:.{places}f}".replace("-0.000", "0.000") == text


@pytest.mark.parametrize("case", EXPECTED)
def test_figures_come_out_to_every_printed_digit(case):
    run = run_of(case)
    _, ends, paths, slips = EXPECTED[case]
    assert run.outcome == "completed"
    for value, text in zip(run.slip_ends, ends, strict=True):
        assert printed_alike(1e3 * value, text), (value, text)
    for value, text in zip(run.slip_path, paths, strict=True):
        assert printed_alike(1e3 * value, text), (value, text)
    for pair, texts in zip(run.slip, slips, strict=True):
        for value, text in zip(pair, texts, strict=True):
            assert text is None or printed_alike(1e3 * value, text), (value, text)


@pytest.mark.parametrize("case", EXPECTED)
def test_energy_is_accounted_for(case):
    assert abs(run_of(case).ledger) < 2e-9


@pytest.mark.parametrize(
    ("case", "height"), [("s2", 9.661), ("planar-1", 5.817), ("planar-2", 9.713)]
)
def test_errors_of_the_lift_at_50_ms(case, height):
    assert round(1e3 * run_of(case).errors[0][2], 3) == height


@pytest.mark.parametrize("case", ["planar-1", "planar-2"])
def test_two_opposed_fingers_stay_in_their_plane(case):
    run = run_of(case)
    assert np.abs(run.slip[:, 1]).max() < ROUNDING
    assert np.abs(run.errors[0][[1, 3, 5]]).max() < ROUNDING


FIRST = 0.002
ACCURACY = 1e-10  # of slips of some 10 um, where the integrator steps otherwise [m]


def first_ticks(world):
    """Slips, errors and estimates after the first ticks, in which all contacts slip."""
    simulator = Simulator(world._replace(tolerance=1e-9), (FIRST,))
    simulator.simulate(FIRST)
    return simulator


def test_two_identical_runs_are_equal_bit_for_bit():
    one, other = first_ticks(s3()), first_ticks(s3())
    assert np.array_equal(one.z, other.z)
    assert np.array_equal(one.estimates, other.estimates)


def permuted(world, order):
    """The same hand with its fingers in another order."""
    hand, truth = world.hand, world.truth
    fingers = type(hand.fingers)(*(part[order] for part in hand.fingers))
    truth = truth._replace(link_masses=truth.link_masses[order], friction=truth.friction[order])
    return world._replace(
        hand=hand._replace(fingers=fingers, anchors=hand.anchors[order], faces=hand.faces[order]),
        truth=truth,
        unknowns=world.unknowns._replace(known=truth),
    )


def test_the_order_of_the_fingers_does_not_matter():
    order = np.array([1, 2, 0])
    one, other = first_ticks(s3()), first_ticks(permuted(s3(), order))
    np.testing.assert_allclose(other.run.slip, one.run.slip[order], atol=1e-12)
    np.testing.assert_allclose(other.z[:13], one.z[:13], atol=1e-11)
    np.testing.assert_allclose(other.estimates[:3], one.estimates[order], atol=1e-9)


def test_the_mirrored_hand_makes_the_mirrored_run():
    """y -> -y exchanges fingers 2 and 3: s_x stays, s_y changes its sign."""
    order = np.array([0, 2, 1])
    world = s3()
    truth = world.truth._replace(friction=world.truth.friction[order])
    other = first_ticks(world._replace(truth=truth, unknowns=world.unknowns._replace(known=truth)))
    one = first_ticks(world)
    np.testing.assert_allclose(other.run.slip, one.run.slip[order] * [1.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(other.z[:3], one.z[:3] * [1.0, -1.0, 1.0], atol=1e-12)


def test_the_hand_may_be_turned_about_the_vertical():
    turn = Rotation.from_rotvec([0.0, 0.0, 0.7])
    hand = prism_hand()
    turned = hand_of(
        turn.apply(hand.fingers.bases), turn.apply(hand.anchors), turn.apply(hand.faces[:, :, 2])
    )
    one, other = first_ticks(s3()), first_ticks(s3()._replace(hand=turned))
    np.testing.assert_allclose(other.run.slip, one.run.slip, atol=ACCURACY)
    np.testing.assert_allclose(turn.apply(one.z[:3]), other.z[:3], atol=ACCURACY)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_body_frame_turned_by_a_quarter_makes_the_same_run(sign):
    """Inertias change places with the axes; -Q is the same attitude as Q."""
    turn = Rotation.from_euler("x", 90, degrees=True)
    back = turn.inv().as_matrix()
    x, y, z, w = sign * turn.as_quat()
    world = s3()
    inertias = world.truth.object_inertias[[0, 2, 1]]
    truth = world.truth._replace(object_inertias=inertias)
    hand = world.hand._replace(anchors=world.hand.anchors @ back.T, faces=back @ world.hand.faces)

    def desired(t):
        return world.desired(t)._replace(rotation=turn.as_matrix())

    other = first_ticks(
        world._replace(
            hand=hand,
            truth=truth,
            unknowns=world.unknowns._replace(known=truth),
            desired=desired,
            quaternion=(w, x, y, z),
        )
    )
    one = first_ticks(world)
    np.testing.assert_allclose(other.run.slip, one.run.slip, atol=ACCURACY)
    np.testing.assert_allclose(other.z[:3], one.z[:3], atol=ACCURACY)


def test_hold_presses_inside_the_cones_though_contacts_slip():
    """What it gives up is the demand on the slips."""
    simulator = Simulator(s1(), (0.001, 0.002))
    run = simulator.simulate(0.002)
    mu = 0.25
    for command in run.commands:
        tangential = np.linalg.norm(command.forces[:, :2], axis=1)
        assert np.all(tangential <= mu * command.forces[:, 2] * (1.0 + 1e-9))
        assert command.shortfall > 1e-3
