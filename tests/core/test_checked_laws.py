"""A compiled custom law cannot reach memory beyond its arrays, whatever functions it calls."""

import types
from typing import ClassVar

import numba
import numpy as np
import pytest

from slipgrasp import LawParameter, load_scenario, register_law, simulate, with_law, with_values
from slipgrasp.core.scenario.custom_laws import forget

pytestmark = pytest.mark.slow

BEFORE = 5  # ticks in which all goes well
FAULTS = (
    *("writes torque", "writes torque before its start", "writes memory", "writes estimates"),
    *("writes a diagnostic", "writes where a list says", "writes in a parallel loop"),
    *("calls a function that writes", "calls one of a module that writes", "reads"),
)
NOTHING, FROM_THE_END = -1, -2


@numba.njit
def set_entry(array, row):
    array[row, 0] = 1.0


# Compiled without checks for the very types that a law has, before any law calls it.
set_entry(np.zeros((9, 2)), 7)
set_entry(np.zeros((9, 3)), 7)
helpers = types.ModuleType("helpers")
helpers.set_entry = set_entry


@numba.njit(parallel=True)
def set_all(array, count):
    for k in numba.prange(count):
        array[k] = 1.0


@numba.njit
def carry(seen, out):
    """Half of the weight and a grip at every contact, for a planar or a spatial hand."""
    n, axes = seen.contact_normal.shape
    for i in range(n):
        for joint in range(axes):
            torque = 0.0
            for axis in range(axes):
                force = 30.0 * seen.contact_normal[i, axis]
                if axis == axes - 1:
                    force += seen.model.object_mass * seen.model.gravity / n
                torque += seen.jacobian[i, axis, joint] * force
            out.torque[i, joint] = torque - 0.1 * seen.joint_velocity[i, joint]


@numba.njit
def command(seen, memory, out):
    carry(seen, out)
    n, fault = len(seen.slip), seen.parameters.fault
    if fault == FROM_THE_END:
        for i in range(1, 1 + n):
            out.torque[-i, 0] = out.torque[n - i, 0]
        memory.x[-1] = seen.joint_velocity[-1, -1]
    if fault < 0 or seen.tick < BEFORE:
        return
    if fault == 0:
        out.torque[7, 0] = 1.0
    elif fault == 1:
        out.torque[-1 - n, 0] = 1.0
    elif fault == 2:
        memory.x[seen.tick] = 1.0
    elif fault == 3:
        out.estimates[len(seen.estimates)] = 1.0
    elif fault == 4:
        out.told[1] = 1.0
    elif fault == 5:
        out.torque[np.array([0, 7])] = 1.0
    elif fault == 6:
        set_all(memory.x, 9)
    elif fault == 7:
        set_entry(out.torque, 7)
    elif fault == 8:
        helpers.set_entry(out.torque, 7)
    elif fault == 9:
        out.told[0] = seen.joint_velocity[7, 0]


class Faulty:
    """Carries the object, and then does something that it may not."""

    parameters: ClassVar = {
        "fault": LawParameter(value=-1.0, minimum=-2.0, maximum=9.0, text="Which.")
    }
    memory: ClassVar = {"x": (BEFORE,)}
    diagnostics: ClassVar = {"told": ("1", "Anything.")}
    command = staticmethod(command)


def run_of(preset, fault, law=Faulty):
    register_law(law)
    try:
        values = {"simulation.duration": 0.05, "controller.parameters.fault": float(fault)}
        return simulate(with_values(with_law(load_scenario(preset), "faulty"), values))
    finally:
        forget("faulty")


@pytest.mark.parametrize("preset", ["composite-case-2", "spatial-composite"])
@pytest.mark.parametrize("fault", range(len(FAULTS)), ids=FAULTS)
def test_an_index_outside_an_array_ends_the_run_and_is_named(fault, preset):
    result = run_of(preset, fault)
    assert (result.outcome, result.reason.code) == ("failed", "law_failed")
    assert "IndexError: index " in result.reason.message
    assert "is out of bounds for axis 0 with size" in result.reason.message
    assert "test_checked_laws.py, line" in result.reason.message
    assert len(result.ticks) == BEFORE


@pytest.mark.parametrize("preset", ["composite-case-2", "spatial-composite"])
def test_a_negative_index_counts_from_the_end_as_in_numpy(preset):
    one, other = (run_of(preset, fault) for fault in (FROM_THE_END, NOTHING))
    assert one.outcome == other.outcome == "completed"
    assert one.trace.to_rows().tobytes() == other.trace.to_rows().tobytes()


def test_what_others_compile_of_a_function_that_a_law_calls_has_no_checks_before_and_after():
    before = {kinds: made.entry_point for kinds, made in set_entry.overloads.items()}
    run_of("composite-case-2", FAULTS.index("calls a function that writes"))
    after = {kinds: made.entry_point for kinds, made in set_entry.overloads.items()}
    assert after == before
