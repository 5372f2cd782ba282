"""The page "Why does my object slip?" agrees with the simulation of the same gripper."""

import random

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.web.standalone.grip_page import FIELDS, WAY, Grip, answer_of, grip_page

DURATION = 0.3  # [s]
MARGIN = 1.1  # stiff jaws still swing a little when the arm starts


def drawn(seed):
    """A grip whose load is at least a tenth off what its friction offers."""
    source = random.Random(seed)
    mass, friction = source.uniform(0.1, 2.0), source.uniform(0.2, 0.9)
    acceleration = source.uniform(0.0, 8.0)
    need = mass * (9.81 + acceleration) / (2.0 * friction)
    share = source.choice((source.uniform(0.3, 1.0 / MARGIN), source.uniform(MARGIN, 2.0)))
    return Grip(mass, friction, share * need, source.uniform(0.005, 0.03), acceleration)


def run_of(grip, arm=0.0):
    """The same gripper, with stiff jaws, at a distance from the centre of mass [m]."""
    values = {
        "object.mass": grip.mass,
        "object.inertias": [0.0108 * grip.mass, 0.0108 * grip.mass, 0.0067 * grip.mass],
        "trajectory.acceleration.2": grip.acceleration,
        "trajectory.acceleration_time": DURATION,
        "trajectory.coast_time": 0.0,
        "trajectory.start.1": -arm,
        "controller.control_period": 1e-4,
        "controller.grip_force": grip.grip_force,
        "controller.jaw_stiffness": 2e5,
        "controller.jaw_damping": 600.0,
        "simulation.duration": DURATION,
    }
    for finger, sign in enumerate((-1.0, 1.0)):
        values |= {
            f"fingers.{finger}.friction": grip.friction,
            f"fingers.{finger}.pad_radius": grip.pad_radius,
            f"fingers.{finger}.contact_offset": [0.0, sign * arm],
        }
    return simulate(with_values(load_scenario("parallel-gripper"), values))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_it_slips_when_the_page_says_so_and_as_fast(seed):
    grip = drawn(seed)
    answer, run = answer_of(grip), run_of(grip)
    slip = run.trace.slip_path.max(axis=1)
    if answer.fall <= 0.0:
        assert slip.max() < 1e-4
        return
    if slip.max() < WAY:
        assert answer.time > 0.9 * DURATION
        return
    lost = float(np.interp(WAY, slip, run.trace.times))
    assert lost == pytest.approx(answer.time, rel=0.05, abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_it_pivots_from_the_distance_that_the_page_gives(seed):
    grip = drawn(seed)._replace(acceleration=0.0)
    grip = grip._replace(grip_force=2.0 * answer_of(grip).force)
    arm = answer_of(grip).arm
    turns = [np.abs(run_of(grip, share * arm).trace.spin).max() for share in (0.9, 1.2)]
    assert turns[0] < 1e-3 < 10e-3 < turns[1]


@pytest.mark.browser
def test_the_page_says_what_the_formulas_give(browser, tmp_path):
    path = tmp_path / "why.html"
    path.write_text(grip_page(), encoding="utf-8")
    page = browser.new_page(viewport={"width": 360, "height": 740})
    try:
        page.goto(path.as_uri())
        output = page.locator("output")
        first = Grip(0.4, 0.35, 6.5, 0.01, 2.3)
        assert f"at least {answer_of(first).force:.3g} N" in output.inner_text()
        assert output.inner_text().startswith("Slips.")
        page.get_by_label("grip force").fill("8")
        arm = 1e3 * answer_of(first._replace(grip_force=8.0)).arm
        assert f"within {arm:.3g} mm" in output.inner_text()
        page.get_by_label("radius").fill("0")
        assert "but pivots" in output.inner_text()
        page.get_by_label("mass").fill("")
        assert "Enter five numbers" in output.inner_text()
        assert page.evaluate("document.documentElement.scrollWidth") <= 360
        assert len(FIELDS) == page.locator("input").count()
    finally:
        page.close()
