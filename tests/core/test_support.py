"""A body on a support: closed forms, an independent integration, and invariants."""

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario import SupportScenario
from slipgrasp.core.scenario.loading import (
    load_scenario,
    scenario_from_mapping,
    with_values,
)
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.types import ContactPhase, Outcome

G = 9.81
EXACT = 1e-9
CLOSE = {"relative_tolerance": 1e-11, "absolute_tolerance": 1e-13}
NUM_RANDOM = 20


def support(**tables: Any) -> SupportScenario:
    scenario = scenario_from_mapping({"support": {}, **tables})
    assert isinstance(scenario, SupportScenario)
    return scenario


def run(**tables: Any) -> RunResult:
    result = simulate(support(**tables))
    assert result.outcome is Outcome.COMPLETED
    return result


def stop_of(result: RunResult) -> float:
    """Time of the last stop [s]."""
    time = result.metrics.last_slip_time
    assert time is not None
    return time


@pytest.mark.parametrize(("speed", "friction"), [(1.0, 0.21), (0.3, 0.05), (4.0, 0.9)])
def test_a_thrown_block_stops_where_coulomb_says(speed: float, friction: float) -> None:
    result = run(
        support={"friction": friction},
        motion={"velocity": [speed, 0.0, 0.0]},
        simulation={"duration": 2.0},
    )
    assert stop_of(result) == pytest.approx(speed / (friction * G), abs=EXACT)
    assert result.metrics.slip_path[0] == pytest.approx(speed**2 / (2 * friction * G), abs=EXACT)
    assert result.metrics.held is True
    assert np.abs(result.trace.energy_residual).max() < EXACT
    assert [change.to_phase for change in result.phase_changes] == [
        ContactPhase.SLIP,
        ContactPhase.STICK,
    ]
    assert (result.trace.object_velocity[-1] == 0.0).all()


@pytest.mark.parametrize("friction", [0.9, 0.3])
def test_a_block_thrown_up_an_incline(friction: float) -> None:
    angle, speed, duration = 0.5, 2.0, 1.0
    rise, bound = G * math.sin(angle), friction * G * math.cos(angle)
    result = run(
        support={"friction": friction, "incline": angle},
        motion={"velocity": [speed, 0.0, 0.0]},
        simulation={"duration": duration},
    )
    stop, top = speed / (rise + bound), speed**2 / (2 * (rise + bound))
    stops = [c.time for c in result.phase_changes if c.to_phase is ContactPhase.STICK]
    assert stops == [pytest.approx(stop, abs=EXACT)]
    assert np.abs(result.trace.energy_residual).max() < EXACT
    back = 0.5 * max(rise - bound, 0.0) * (duration - stop) ** 2
    assert result.trace.object_pose[-1, 0] == pytest.approx(top - back, abs=EXACT)
    assert result.metrics.slip_path[0] == pytest.approx(top + back, abs=EXACT)
    assert result.metrics.slipping_at_end is (friction < math.tan(angle))
    # A body that slides back at once has a stop and an onset at the same time.
    assert len(result.phase_changes) == (3 if friction < math.tan(angle) else 2)


@pytest.mark.parametrize("share", [0.999, 1.001])
def test_a_pushed_block_moves_above_its_static_friction(share: float) -> None:
    mass, sliding, static, begin, length = 2.0, 0.2, 0.3, 0.1, 0.3
    force = share * static * mass * G
    result = run(
        object={"mass": mass},
        support={"friction": sliding, "static_friction": static},
        pulses=[{"time": begin, "duration": length, "force": [0.0, force]}],
        simulation={"duration": 2.0},
    )
    if share < 1.0:
        assert result.metrics.slip_path == (0.0,)
        least = static * mass * G * (1.0 - share)
        assert result.metrics.minimum_friction_margin[0] == pytest.approx(least, abs=EXACT)
        return
    speed = (force / mass - sliding * G) * length
    assert stop_of(result) == pytest.approx(begin + length + speed / (sliding * G), abs=EXACT)
    slid = 0.5 * speed * (stop_of(result) - begin)
    assert result.metrics.slip_path[0] == pytest.approx(slid, abs=EXACT)
    assert result.trace.supplied_energy[-1] == pytest.approx(
        force * 0.5 * speed * length, abs=EXACT
    )


def test_a_pure_spin_stops_by_the_friction_moment() -> None:
    mass, inertia, radius, friction, spin = 0.37, 7e-4, 0.036, 0.21, 9.0
    result = run(
        object={"mass": mass, "inertia": inertia},
        support={"friction": friction, "radius": radius},
        motion={"velocity": [0.0, 0.0, spin]},
    )
    slowing = friction * mass * G * radius / inertia
    assert stop_of(result) == pytest.approx(spin / slowing, abs=EXACT)
    assert result.metrics.spin_end[0] == pytest.approx(spin**2 / (2 * slowing), abs=EXACT)
    assert result.metrics.slip_path[0] == 0.0
    assert result.trace.torsional_moment[1, 0] == pytest.approx(-radius * friction * mass * G)


def test_with_equal_mobilities_a_turning_body_slides_straight() -> None:
    mass, radius, friction, speed, spin = 0.5, 0.04, 0.3, 0.8, 12.0
    result = run(
        object={"mass": mass, "inertia": mass * radius**2},
        support={"friction": friction, "radius": radius},
        motion={"velocity": [speed, 0.0, spin]},
    )
    size = math.hypot(speed, radius * spin)
    assert stop_of(result) == pytest.approx(size / (friction * G), abs=EXACT)
    share = size / (2 * friction * G)
    assert result.trace.object_pose[-1, 0] == pytest.approx(speed * share, abs=EXACT)
    assert result.trace.object_pose[-1, 2] == pytest.approx(spin * share, abs=EXACT)


def test_without_a_radius_the_body_turns_freely_also_at_rest() -> None:
    result = run(motion={"velocity": [0.5, 0.0, 3.0]})
    assert stop_of(result) == pytest.approx(0.5 / (0.21 * G), abs=EXACT)
    assert result.trace.object_pose[-1, 2] == pytest.approx(3.0, abs=EXACT)
    assert result.trace.object_velocity[-1, 2] == 3.0


def test_a_load_beside_the_centre_begins_the_slip_in_its_own_direction() -> None:
    """From rest under a constant load, the direction of slip is constant."""
    mass, inertia, radius, friction = 1.0, 2e-3, 0.05, 0.2
    force, moment = (2.0, 1.0), 0.12
    result = run(
        object={"mass": mass, "inertia": inertia},
        support={"friction": friction, "radius": radius},
        pulses=[{"time": 0.0, "duration": 5.0, "force": list(force), "moment": moment}],
    )
    velocity = result.trace.object_velocity[2:]
    sliding = velocity * [1.0, 1.0, radius]
    directions = sliding / np.linalg.norm(sliding, axis=1)[:, None]
    assert np.abs(directions - directions[-1]).max() < EXACT
    load = np.array([*force, moment / radius])
    masses = np.array([mass, mass, inertia / radius**2])
    slopes = (load - friction * mass * G * directions[-1]) / masses
    assert np.cross(slopes, directions[-1]) == pytest.approx(0.0, abs=EXACT)
    assert np.abs(velocity[-1] - slopes / [1.0, 1.0, radius]).max() < EXACT


def drawn(seed: int) -> SupportScenario:
    """A random scenario with pulses and changes."""
    draw = np.random.default_rng(seed)
    radius = float(draw.choice([0.0, draw.uniform(0.005, 0.2)]))
    friction = float(draw.uniform(0.05, 0.8))
    pulses = [
        {
            "time": float(draw.uniform(0.0, 0.8)),
            "duration": float(draw.uniform(0.05, 0.4)),
            "force": draw.uniform(-6.0, 6.0, 2).tolist(),
            "moment": float(draw.uniform(-0.1, 0.1)),
        }
        for _ in range(int(draw.integers(0, 4)))
    ]
    return support(
        object={"mass": float(draw.uniform(0.2, 2.0)), "inertia": float(draw.uniform(5e-4, 5e-3))},
        support={
            "friction": friction,
            "static_friction": friction * float(draw.choice([1.0, 1.3])),
            "radius": radius,
            "incline": float(draw.choice([0.0, draw.uniform(-0.6, 0.6)])),
        },
        motion={"velocity": (draw.uniform(-1.0, 1.0, 3) * [1.0, 1.0, 10.0]).tolist()},
        pulses=pulses,
        changes=[{"time": 0.5, "parameter": "object.mass", "value": float(draw.uniform(0.2, 2.0))}]
        if draw.random() < 0.3
        else [],
    )


@pytest.mark.parametrize("seed", range(NUM_RANDOM))
def test_the_smooth_part_agrees_with_an_independent_integration(seed: int) -> None:
    scenario = drawn(seed)
    scenario = replace(
        scenario, pulses=(), changes=(), simulation=replace(scenario.simulation, **CLOSE)
    )
    draw = np.random.default_rng(seed)
    load = tuple(draw.uniform(-1.0, 1.0, 2).tolist()), float(draw.uniform(-0.02, 0.02))
    scenario = with_values(
        scenario,
        {
            "pulses.0.time": 0.0,
            "pulses.0.duration": 5.0,
            "pulses.0.force": list(load[0]),
            "pulses.0.moment": load[1],
        },
    )
    result = simulate(scenario)
    end = result.phase_changes[1].time if len(result.phase_changes) > 1 else result.end_time
    body, plane = scenario.object, scenario.support
    normal = body.mass * G * math.cos(plane.incline)
    fall = body.mass * G * math.sin(plane.incline)

    def slope(_: float, state: NDArray[np.float64]) -> NDArray[np.float64]:
        sliding = state[3:] * [1.0, 1.0, plane.radius]
        friction = -plane.friction * normal * sliding / np.linalg.norm(sliding)
        return np.array(
            [
                *state[3:],
                (load[0][0] - fall + friction[0]) / body.mass,
                (load[0][1] + friction[1]) / body.mass,
                (load[1] + plane.radius * friction[2]) / body.inertia,
            ]
        )

    # Up to just before a stop, where the direction is stiff.
    begin, until = [0.0, 0.0, 0.0, *scenario.motion.velocity], 0.98 * end
    rows = np.flatnonzero((result.trace.times > 0.0) & (result.trace.times < until))
    solved = solve_ivp(
        slope, (0.0, until), begin, "DOP853", result.trace.times[rows], rtol=1e-12, atol=1e-13
    )
    found = np.hstack([result.trace.object_pose, result.trace.object_velocity])[rows]
    assert np.abs(found - solved.y.T).max() < 2e-8


@pytest.mark.parametrize("seed", range(100, 100 + 2 * NUM_RANDOM))
def test_friction_stays_on_its_surface_and_never_returns_energy(seed: int) -> None:
    scenario = drawn(seed)
    result = simulate(scenario)
    assert result.outcome is Outcome.COMPLETED
    trace = result.trace
    assert np.abs(trace.energy_residual).max() < 1e-8
    assert np.diff(trace.dissipated_energy).min() >= -1e-12
    assert trace.friction_margin[1:].min() > -EXACT
    radius = scenario.support.radius
    moment = trace.torsional_moment[:, 0] / radius if radius else 0.0
    size = np.sqrt(trace.tangential_size[:, 0] ** 2 + moment**2)
    # The first row has the stick that every run assumes.
    assert (size - trace.friction_coefficient[:, 0] * trace.normal_force[:, 0])[1:].max() < EXACT
    rests = trace.phase[:, 0] == ContactPhase.STICK
    assert (trace.object_velocity[rests][1:, : 3 if radius else 2] == 0.0).all()


def test_a_run_is_described_in_words_without_a_hand() -> None:
    moving = run(support={"friction": 0.3}, motion={"velocity": [0.5, 0.0, 0.0]})
    described = describe_run(moving)
    assert described.headline == "The body slid 42.5 mm and stopped at 0.17 s"
    assert described.tone == "good"
    short = describe_run(run(motion={"velocity": [1.0, 0.0, 0.0]}, simulation={"duration": 0.2}))
    assert short.headline == "The body slid 159 mm and still slides at the end"
    assert "simulation.duration" in short.suggestion
    assert describe_run(run()).headline == "The body stayed at rest"
    words = " ".join([*described.sentences, *short.sentences, short.suggestion])
    assert not re.search("finger|hand|law|controller", words)


def test_a_limit_of_steps_ends_a_run_with_a_way_out() -> None:
    result = simulate(support(simulation={"max_steps": 3}, motion={"velocity": [1.0, 0.0, 0.0]}))
    assert result.outcome is Outcome.LIMIT
    assert result.reason is not None and "3 steps" in result.reason.message
    assert "simulation.max_steps" in describe_run(result).suggestion


@pytest.mark.parametrize("name", ["sliding-block", "spinning-slide"])
def test_a_preset_agrees_with_its_closed_form(name: str) -> None:
    scenario = load_scenario(name)
    assert isinstance(scenario, SupportScenario)
    result = simulate(with_values(scenario, {f"simulation.{k}": v for k, v in CLOSE.items()}))
    body, plane, (vx, _, omega) = scenario.object, scenario.support, scenario.motion.velocity
    if name == "sliding-block":
        assert stop_of(result) == pytest.approx(vx / (plane.friction * G), abs=EXACT)
        slid = vx**2 / (2 * plane.friction * G)
        assert result.metrics.slip_path[0] == pytest.approx(slid, abs=EXACT)
        return
    # d ln(q) / dt = mu g (1 - k) / |u| with q = c omega / v, k = c² / r²; and v' = -mu g v / |u|:
    # v is proportional to q^(1 / (k - 1)), all along the slide.
    ratio = plane.radius**2 * body.mass / body.inertia
    rows = np.flatnonzero(result.trace.object_velocity[:, 0] > 1e-3)
    speed = result.trace.object_velocity[rows, 0]
    spin = plane.radius * result.trace.object_velocity[rows, 2]
    expected = vx * ((spin / speed) / (plane.radius * omega / vx)) ** (1.0 / (ratio - 1.0))
    assert speed == pytest.approx(expected, rel=1e-7)


def test_signals_of_hands_are_no_columns() -> None:
    names = [column.name for column in columns_of(run().trace)]
    assert {"slip_x_0", "slip_path_0", "spin_0", "torsional_moment_0"} <= set(names)
    unwanted = ("error", "torque", "joint", "input_rank", "controllability", "believed", "lyapunov")
    assert [name for name in names if name.startswith(unwanted)] == []


@pytest.mark.parametrize(
    ("tables", "field"),
    [
        ({"support": {"friction": -0.1}}, "support.friction"),
        ({"support": {"friction": 0.3, "static_friction": 0.2}}, "support.static_friction"),
        ({"support": {"incline": 1.6}}, "support.incline"),
        ({"controller": {"kind": "theorem-3"}}, "controller"),
        ({"trajectory": {"kind": "circle"}}, "trajectory"),
        ({"fingers": []}, "fingers"),
        ({"changes": [{"time": 0.5, "parameter": "motion.start.0", "value": 1.0}]}, "changes.0"),
        ({"pulses": [{"time": 3.0}]}, "pulses.0.time"),
        ({"object": {"corners": [[0.0, 0.0], [0.1, 0.0]]}}, "object.corners"),
    ],
)
def test_a_wrong_field_is_named(tables: dict[str, Any], field: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        support(**tables)
    assert caught.value.errors[0].field.startswith(field)
    assert "finger" not in str(caught.value) or field == "fingers"
