"""Sentences of docs/figures.md and docs/model.md, with their numbers made again from the runs."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from slipgrasp.core.run.premises import find_premises
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from tests.state_evaluation import evaluate_state

pytestmark = pytest.mark.slow

DOCS = Path(__file__).parents[2] / "docs"
CASE_1, CASE_2 = load_scenario("paper-case-1"), load_scenario("paper-case-2")
REST = np.zeros(2)


@cache
def words_of(page):
    return " ".join((DOCS / page).read_text(encoding="utf-8").split())


@cache
def run(case):
    return simulate(load_scenario(f"paper-case-{case}"))


def at(case, time):
    return int(np.searchsorted(run(case).trace.times, time))


def missing(page, told):
    return [words for words in told if words not in words_of(page)]


def fastest_change(case, since):
    """Greatest rate of the estimates, as means over 10 ms, after an instant."""
    trace, grid = run(case).trace, np.arange(0.0, 7.005, 0.01)
    values = np.stack([np.interp(grid, trace.times, column) for column in trace.estimates.T])
    rates = np.linalg.norm(np.diff(values, axis=1), axis=0) / 0.01
    return rates[grid[1:] > since].max()


def test_case_1_is_told_with_its_numbers():
    trace, metrics = run(1).trace, run(1).metrics
    error, slip, speed = 1e3 * trace.tracking_error, metrics.slip_path, trace.slip_velocity
    lowest, stops = error[:, 1].argmax(), {c.contact: c.time for c in run(1).phase_changes}
    force, share = trace.normal_force, np.abs(trace.tangential_force) / 0.25 / trace.normal_force
    masses, mass = trace.estimates[-1, :4], trace.estimates[:, 4]
    told = [
        f"$e_x$ stays within {np.abs(error[:, 0]).max():.1f} mm",
        f"sags by {error[lowest, 1]:.0f} mm at {trace.times[lowest]:.2f} s",
        f"still {error[-1, 1]:.0f} mm low at 7 s",
        f"at most {np.abs(error[:, 2]).max():.1f} mrad",
        f"left fingertip slips {1e3 * slip[0]:.2f} mm at up to "
        f"{1e3 * np.abs(speed[:, 0]).max():.0f} mm/s and stops at {1e3 * stops[0]:.0f} ms",
        f"right one slips {1e3 * slip[1]:.2f} mm and stops at {1e3 * stops[1]:.0f} ms",
        f"from 0.5 kg to {mass[at(1, 1.0)]:.2f} kg within 1 s and to {mass[-1]:.2f} kg at 7 s",
        "end at {:.2f}, {:.2f}, {:.2f} and {:.2f} kg".format(*masses),
        f"At most {np.abs(trace.joint_torque).max():.0f} N m",
        f"from {force[0].max():.0f} N to {force.max():.0f} N at 0.2 s and settles near "
        f"{force[-1].max():.0f} N",
        f"{100 * share[-1, 0]:.0f} % of the friction on the left and {100 * share[-1, 1]:.0f} %",
    ]
    assert missing("figures.md", told) == []
    assert fastest_change(1, 0.0) / fastest_change(1, 1.0) == pytest.approx(100.0, rel=0.1)
    assert trace.times[force.argmax(axis=0)] == pytest.approx([0.2, 0.2], abs=0.01)
    ringing = (trace.times > 0.1) & (trace.times < 0.8)
    turned = error[ringing, 2] - error[ringing, 2].mean()
    crossings = trace.times[ringing][1:][np.diff(np.sign(turned)) != 0.0]
    assert 2.0 * np.diff(crossings).mean() == pytest.approx(0.11, abs=0.01)


def test_case_2_is_told_with_its_numbers():
    trace, metrics = run(2).trace, run(2).metrics
    error, force, mass = 1e3 * trace.tracking_error[:, 1], trace.normal_force, trace.estimates[:, 2]
    low, high = error.argmax(), error.argmin()
    share = np.abs(trace.tangential_force[-1]) / 0.25 / force[-1]
    told = [
        f"{force[1, 0]:.1f} N at the start",
        f"sags by {error[low]:.0f} mm at {trace.times[low]:.1f} s",
        f"{-error[high]:.0f} mm above its path at {trace.times[high]:.1f} s",
        f"is {-error[-1]:.0f} mm above it at 7 s",
        f"slip {1e3 * metrics.slip_path[0]:.1f} mm of the available 145.8 mm, at up to "
        f"{np.abs(trace.slip_velocity).max():.2f} m/s, and stop at "
        f"{1e3 * metrics.last_slip_time:.0f} ms",
        f"to {trace.estimates[-1, 0]:.3f} and freezes there",
        f"overshoots to {mass.max():.2f} kg and comes back slowly, {mass[-1]:.2f} kg at 7 s",
        f"At most {np.abs(trace.joint_torque).max():.0f} N m, at 0.1 s",
        f"rises from {force[1, 0]:.1f} N to {force.max():.0f} N",
        f"settles at {force[-1, 0]:.0f} N",
        f"uses {100 * share[0]:.0f} % of the cone",
    ]
    assert missing("figures.md", told) == []
    assert np.abs(trace.tracking_error[:, [0, 2]]).max() < 1e-14
    assert CASE_2.object.face_half_length == 0.1458


def test_the_premises_are_told_with_their_numbers():
    one, two = find_premises(run(1)), find_premises(run(2))
    least = min(np.nanmin(each.least_excitation) for each in (one, two))
    greatest = max(np.nanmax(each.greatest_excitation) for each in (one, two))
    told = [
        f"the smallest eigenvalue of the integral is {least:.1e}".replace("e-05", "e-5"),
        f"the largest {greatest:.1f} in both cases",
        f"falls from {one.error[0]:.3f} to {one.error[-1]:.3f} in case I",
        f"from {two.error[0]:.2f} to {two.error[-1]:.3f} in case II",
        f"in case II it is {two.disturbance.max():.0f} at most",
    ]
    assert missing("figures.md", told) == []
    assert (one.error.max(), two.error.max()) == (one.error[0], two.error[0])
    assert np.isinf(one.radius).all()
    assert np.isinf(two.radius).all()


def evaluated(scenario, phase):
    start = scenario.trajectory.start
    return evaluate_state(scenario, 0.0, start, np.zeros(3), REST, REST, phase, np.ones(5))


def test_where_the_reduced_inertia_is_singular():
    def determinant(mu):
        rough = with_values(CASE_1, {"fingers.0.friction": mu, "fingers.1.friction": mu})
        return np.linalg.det(evaluated(rough, (-1, 1)).reduced_inertia)

    vanishes = brentq(determinant, 1.0, 2.0)
    assert missing("figures.md", [rf"$\det\tilde M$ vanishes at $\mu = {vanishes:.2f}$"]) == []
    assert missing("model.md", [f"at $\\mu = {vanishes:.2f}$)"]) == []


def test_what_the_lift_asks_of_friction_without_a_grasp_force():
    bare = with_values(CASE_1, {"controller.grasp_force": "none"})
    (along, normal), _ = evaluated(bare, (0, 0)).contact_forces
    told = [rf"$\lvert F_x\rvert / F_n = {abs(along) / normal:.2f}$"]
    assert missing("model.md", told) == []


def test_how_far_from_its_cone_the_composite_law_must_stay():
    """On their edge it switches at most of its ticks: between 1 and 1.001."""
    base = with_values(load_scenario("composite-case-2"), {"simulation.duration": 2.0})
    ticks = 2.0 / base.controller.control_period
    for safety, switches in ((1.0, True), (1.001, False)):
        at_this = simulate(with_values(base, {"controller.grip_safety": safety}))
        assert (at_this.metrics.phase_change_count > ticks) == switches
        assert switches or at_this.metrics.phase_change_count < 10
