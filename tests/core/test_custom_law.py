"""Custom laws of planar and spatial hands: three front ends, memory, diagnostics, failures."""

from dataclasses import replace
from pathlib import Path
from typing import ClassVar

import numba
import numpy as np
import pytest

from slipgrasp import (
    LawError,
    LawParameter,
    ScenarioError,
    Simulation,
    load_law,
    load_scenario,
    register_law,
    simulate,
    with_law,
    with_values,
)
from slipgrasp.core.run.simulator import run_to_end
from slipgrasp.core.run.verdict import describe_run
from slipgrasp.core.scenario import CONTROL_LAWS, Change
from slipgrasp.core.trace.columns import columns_of
from tests.core.test_closed_loop_identities import state_of
from tests.core.test_composite import at_ticks
from tests.references.closed_loop import ClosedLoop
from tests.references.noise import normal_numbers

pytestmark = pytest.mark.usefixtures("known_laws")

LAWS = Path(__file__).parents[2] / "examples" / "laws" / "pd_gravity.py"
BASE = with_law(load_scenario("composite-case-2"), "pd-gravity")
SHORT = with_values(BASE, {"simulation.duration": 0.2})
IN_SPACE = with_values(
    with_law(load_scenario("spatial-composite"), "pd-gravity"), {"simulation.duration": 0.2}
)
each_hand = pytest.mark.parametrize("short", [SHORT, IN_SPACE], ids=["planar", "spatial"])


def rows(result):
    return result.trace.to_rows().tobytes()


def of_law(kind, scenario=BASE, **values):
    return with_values(scenario, {"controller.kind": kind, **values})


def count(seen, memory, out):
    """Forces that carry the object, damped joints, and how often it was asked."""
    memory.count[0] += 1
    memory.times[1, 2] += seen.time
    n, axes = seen.contact_normal.shape
    for i in range(n):
        for joint in range(axes):
            lift = seen.model.object_mass * seen.model.gravity / n
            torque = lift * seen.jacobian[i, axes - 1, joint]
            for axis in range(axes):
                torque += 30.0 * seen.contact_normal[i, axis] * seen.jacobian[i, axis, joint]
            damped = seen.parameters.damping * seen.joint_velocity[i, joint]
            out.torque[i, joint] = torque - damped
    out.asked[0] = memory.count[0]
    out.sum[0] = memory.times[1, 2]


DAMPING = LawParameter(value=0.1, unit="N m s", minimum=0.0, maximum=1.0, text="Of the joints.")


class Counting:
    """Carries the object, counts its ticks, and tells how often it was asked."""

    name = "counting"
    parameters: ClassVar = {"damping": DAMPING}
    diagnostics: ClassVar = {"asked": ("1", "How often."), "sum": ("s", "Of the times.")}
    memory: ClassVar = {"count": 1, "times": (2, 3)}

    def command(self, seen, memory, out):
        count(seen, memory, out)


class CompiledCounting(Counting):
    """The same, compiled."""

    name = "compiled-counting"
    command = staticmethod(numba.njit(count))


def carrying_torque(seen):
    """Forces that hold the weight: J^T f, f half of it and a grip at every contact."""
    forces = 20.0 * seen.contact_normal
    forces[:, -1] += seen.model.object_mass * seen.model.gravity / len(seen.slip)
    return np.einsum("nij,ni->nj", seen.jacobian, forces)


class Feeling:
    """Carries the object, and tells the contact forces that it measures."""

    diagnostics: ClassVar = {
        f"{axis}{i}": ("N", "Measured.") for i in range(2) for axis in ("along", "normal")
    }

    def command(self, seen, memory, out):
        out.torque[:] = carrying_torque(seen)
        felt = seen.contact_force.ravel()
        out.along0[0], out.normal0[0], out.along1[0], out.normal1[0] = felt


class Late:
    """Works until it raises."""

    def command(self, seen, memory, out):
        out.torque[:] = carrying_torque(seen)
        if seen.tick == 5:
            raise ValueError("no torque left")  # the line that is told


class Unbounded:
    """Answers with a number that is not finite."""

    def command(self, seen, memory, out):
        out.torque[:] = carrying_torque(seen)
        if seen.tick == 3:
            out.torque[1, 0] = np.inf


def felt_and_true(**values):
    """Contact forces as a law measured them at ticks 1, 2, …, and those of the reference.

    The reference solves the plant at the state of the tick under the torque of the tick before.
    """
    register_law(Feeling)
    values = {"simulation.duration": 0.3, "simulation.output_rate": 1000.0, **values}
    scenario = of_law("feeling", **values)
    result, loop = simulate(scenario), ClosedLoop.from_scenario(scenario)
    trace, ticks = result.trace, result.ticks
    felt, true = ticks.diagnostics[1:].reshape(-1, 2, 2), []
    assert np.all(trace.phase == 0)
    for row, torques in zip(at_ticks(trace)[1:], ticks.commands, strict=False):
        state = state_of(trace, row)
        true.append(loop.solve_plant(state, (0, 0), torques).forces * [-1.0, 1.0])
    return felt, np.array(true)


def test_a_law_is_shown_the_contact_forces_under_the_torque_that_acts():
    felt, true = felt_and_true()
    assert len(felt) == len(true) == 299
    assert np.ptp(true[:, 0, 0]) > 0.1
    np.testing.assert_allclose(felt, true, atol=1e-9)


def test_measured_contact_forces_have_a_bias_and_noise_from_a_stream_of_their_own():
    felt, true = felt_and_true(
        **{
            "sensing.force_noise": 0.2,
            "sensing.force_bias": [1.0, -2.0],
            "simulation.seed": 5,
        }
    )
    numbers = normal_numbers(5, 300, 4, stream=1)[1:].reshape(-1, 2, 2)
    np.testing.assert_allclose(felt, true + [1.0, -2.0] + 0.2 * numbers, atol=1e-9)


def test_measured_contact_forces_are_filtered_as_accelerations_are():
    felt, true = felt_and_true(**{"sensing.force_filter_time": 0.004})
    value = np.zeros((2, 2))
    for k, (measured, force) in enumerate(zip(felt, true, strict=True), 1):
        value = value + max(0.001 / 0.005, 1.0 / k) * (force - value)
        np.testing.assert_allclose(measured, value, atol=1e-9)


def test_the_built_in_law_written_again_in_python_does_the_same_to_rounding():
    load_law(f"{LAWS}:PdGravity")
    built_in, own = simulate(BASE), simulate(of_law("my-pd"))
    assert own.outcome is built_in.outcome
    assert np.array_equal(own.trace.times, built_in.trace.times)
    assert np.abs(own.ticks.commands - built_in.ticks.commands).max() < 1e-12
    assert np.abs(own.trace.object_pose - built_in.trace.object_pose).max() < 1e-12


def test_the_same_arithmetic_gives_the_same_bits_compiled_in_python_and_from_outside():
    law = load_law(f"{LAWS}:PdGravity")
    command = law.code.command.__globals__["command"]
    load_law(f"{LAWS}:CompiledPdGravity")
    python = simulate(of_law("my-pd", SHORT))
    compiled = simulate(of_law("my-compiled-pd", SHORT))
    simulation = Simulation(SHORT)
    for tick in simulation.ticks():
        command(tick.seen, None, tick)
    outside = simulation.result()
    assert rows(outside) == rows(python)
    assert outside.ticks.to_rows().tobytes() == python.ticks.to_rows().tobytes()
    assert rows(compiled) == rows(python)


@pytest.mark.parametrize("law", [Counting, CompiledCounting])
@each_hand
def test_memory_starts_at_zero_in_every_run_and_lasts_through_it(short, law):
    register_law(law)
    for _ in range(2):
        result = simulate(of_law(law.name, short))
        assert result.outcome == "completed"
        assert result.ticks.diagnostics[:, 0].tolist() == [*range(1, len(result.ticks) + 1)]
        assert result.ticks.diagnostics[-1, 1] == np.cumsum(result.ticks.times)[-1]


@each_hand
def test_a_compiled_law_the_same_in_python_and_its_torques_from_outside_give_equal_bits(short):
    register_law(Counting)
    register_law(CompiledCounting)
    one, other = (simulate(of_law(law.name, short)) for law in (Counting, CompiledCounting))
    assert rows(one) == rows(other)
    stepped = Simulation(short)
    for tick, command in zip(stepped.ticks(), one.ticks.commands, strict=True):
        tick.torque = command.reshape(len(short.fingers), -1)
    again = {column.name: column.values for column in columns_of(stepped.result().trace)}
    columns = {column.name: column.values for column in columns_of(one.trace)}
    assert columns.pop("law_asked")[-1] == len(one.ticks) and columns.pop("law_sum") is not None
    assert columns.keys() == again.keys()
    for name, values in columns.items():
        assert values.tobytes() == again[name].tobytes(), name


@each_hand
def test_parameters_are_keys_with_bounds_and_change_in_mid_run(short):
    register_law(Counting)
    scenario = of_law("counting", short, **{"controller.parameters.damping": 0.5})
    assert scenario.controller.parameters == {"damping": 0.5}
    with pytest.raises(
        ScenarioError, match=r"controller\.parameters\.damping is 2; allowed: 0 … 1"
    ):
        with_values(scenario, {"controller.parameters.damping": 2.0})
    with pytest.raises(ScenarioError, match=r"unknown parameter 'controller\.parameters\.dampng'"):
        with_values(scenario, {"controller.parameters.dampng": 0.2})
    change = Change(time=0.1, parameter="controller.parameters.damping", value=0.0)
    later = simulate(replace(scenario, changes=(change,)))
    before = later.ticks.times < 0.1
    same = simulate(scenario).ticks.commands
    assert np.array_equal(later.ticks.commands[before], same[before])
    assert not np.array_equal(later.ticks.commands[~before][:3], same[~before][:3])


def test_what_is_no_class_cannot_be_registered():
    law = register_law(Counting)
    with pytest.raises(LawError, match="not a CustomLaw; laws from load_law are registered"):
        register_law(law)


def test_what_to_try_names_the_parameters_that_the_law_declares():
    register_law(Counting)
    lost = simulate(of_law("counting", SHORT, **{"object.mass": 8.0, "simulation.duration": 2.0}))
    assert lost.outcome != "completed"
    suggestion = str(describe_run(lost).suggestion)
    assert "hange a parameter that the law declares (controller.parameters.damping)" in suggestion


def test_a_law_that_comes_in_mid_run_finds_its_memory_empty_and_the_run_as_it_was():
    register_law(Counting)
    change = Change(time=0.1, parameter="controller.kind", value="counting")
    result, alone = simulate(replace(SHORT, changes=(change,))), simulate(SHORT)
    before = result.trace.times < 0.1
    assert np.array_equal(result.trace.object_pose[before], alone.trace.object_pose[: before.sum()])
    asked = result.ticks.diagnostics[:, 0]
    assert asked[result.ticks.times < 0.1 - 1e-9].max() == 0.0
    assert asked[-1] == (result.ticks.times > 0.1 - 1e-9).sum()


def test_a_law_that_follows_one_that_learns_finds_its_estimates_and_leaves_them():
    register_law(Counting)
    scenario = with_values(load_scenario("composite-case-2"), {"simulation.duration": 0.2})
    change = Change(time=0.1, parameter="controller.kind", value="counting")
    result = simulate(replace(scenario, changes=(change,)))
    own = result.ticks.estimates[result.ticks.times > 0.1 + 1e-9]
    assert len(own) > 50
    assert np.ptp(own, axis=0).max() == 0.0
    assert np.ptp(result.ticks.estimates, axis=0).max() > 0.0


@each_hand
def test_an_exception_ends_the_run_as_failed_with_its_line_and_keeps_the_rest(short):
    register_law(Late)
    result = simulate(of_law("late", short))
    assert (result.outcome, result.reason.code) == ("failed", "law_failed")
    lines = Path(__file__).read_text(encoding="utf-8").splitlines()
    line = 1 + next(i for i, text in enumerate(lines) if "the line that is told" in text)
    assert "ValueError: no torque left" in result.reason.message
    assert f"test_custom_law.py, line {line}" in result.reason.message
    assert len(result.ticks) == 5
    assert result.end_time == result.reason.time > 0.0


@each_hand
def test_an_answer_that_is_not_finite_ends_the_run_and_names_itself(short):
    register_law(Unbounded)
    result = simulate(of_law("unbounded", short))
    assert (result.outcome, result.reason.code) == ("failed", "law_failed")
    assert "out.torque is not finite" in result.reason.message
    assert len(result.ticks) == 3


def test_the_exception_of_a_compiled_law_tells_its_line_as_well():
    class Broken:
        """Raises."""

        @staticmethod
        @numba.njit
        def command(seen, memory, out):
            if seen.tick == 0:
                raise ValueError("compiled and broken")

    register_law(Broken)
    result = simulate(of_law("broken", SHORT))
    assert result.reason.code == "law_failed"
    assert "ValueError: compiled and broken" in result.reason.message
    assert "test_custom_law.py, line" in result.reason.message


def test_what_interrupts_a_law_is_raised_where_it_was_called_from():
    class Interrupted:
        """Ctrl-C in the midst of it."""

        def command(self, seen, memory, out):
            raise KeyboardInterrupt

    register_law(Interrupted)
    with pytest.raises(KeyboardInterrupt):
        simulate(of_law("interrupted", SHORT))


@pytest.mark.parametrize("kind", CONTROL_LAWS)
def test_the_recorded_commands_alone_give_the_plant_of_any_law_bit_for_bit(kind):
    scenario = with_values(
        with_law(load_scenario("shake-test"), kind), {"simulation.duration": 1.0}
    )
    if scenario.controller.control_period == 0.0:
        scenario = with_values(scenario, {"controller.control_period": 0.001})
    result = simulate(scenario)
    again = Simulation.replaying(result, every_law=True)
    run_to_end(again, lambda _: None)
    assert len(result.ticks) > 0
    for name in ("object_pose", "slip", "joint_torque", "commanded_torque", "estimates", "phase"):
        mine, other = (getattr(r.trace, name) for r in (result, again.result()))
        assert mine.tobytes() == other.tobytes()
    assert again.result().phase_changes == result.phase_changes


@pytest.mark.parametrize(
    ("attributes", "told"),
    [
        ({"name": "composite"}, "a law cannot have the name 'composite'"),
        ({"command": None}, "has no method command"),
        ({"diagnostics": {"torque": ("N", "x")}}, "no diagnostic can have the name 'torque'"),
        ({"diagnostics": {f"d{k}": ("1", "x") for k in range(9)}}, "at most 8"),
        ({"memory": {"x": 0}}, "an invalid shape"),
        ({"parameters": {"x": 1.0}}, "is not a LawParameter"),
    ],
)
def test_a_class_that_declares_itself_wrongly_is_refused(attributes, told):
    code = type("Wrong", (), {"command": lambda *_: None, **attributes})
    with pytest.raises(LawError, match=told):
        register_law(code)


def test_a_law_that_is_not_known_is_refused_with_those_that_are():
    with pytest.raises(ScenarioError, match=r"'no-such-law' is not a known control law.*composite"):
        of_law("no-such-law")
    with pytest.raises(ScenarioError, match="'outside' is not a known control law"):
        of_law("outside")


def test_a_law_needs_sampled_control():
    register_law(Counting)
    with pytest.raises(ScenarioError, match="needs sampled control"):
        of_law("counting", **{"controller.control_period": 0.0})
    with pytest.raises(ScenarioError, match="needs sampled control"):
        next(Simulation(with_values(BASE, {"controller.control_period": 0.0})).ticks())


def test_a_run_has_one_law_of_ones_own_at_most():
    register_law(Counting)
    register_law(Late)
    change = Change(time=0.1, parameter="controller.kind", value="late")
    with pytest.raises(ScenarioError, match="only one custom law"):
        simulate(replace(of_law("counting", SHORT), changes=(change,)))
