"""Recordings of a custom law: read, verified and shown where the law is not installed."""

import json
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from mcap.reader import make_reader

from slipgrasp import (
    LawParameter,
    Simulation,
    load_scenario,
    open_recording,
    register_law,
    simulate,
    verify,
    with_law,
    with_values,
    write_recording,
)
from slipgrasp.core.scenario import CONTROL_LAWS, Change
from slipgrasp.core.scenario.custom_laws import LAW, forget
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.ticks import Ticks

BASE = with_values(
    with_law(load_scenario("composite-case-2"), "pd-gravity"), {"simulation.duration": 0.3}
)


class Carry:
    """Carries the object with a grip that its memory lets grow."""

    name = "carry"
    version = "1.2"
    parameters: ClassVar = {
        "rate": LawParameter(value=2.0, unit="N/s", minimum=0.0, maximum=9.0, text="Of the grip.")
    }
    diagnostics: ClassVar = {"grip": ("N", "Normal force that it asks for.")}
    memory: ClassVar = {"added": 1}

    def command(self, seen, memory, out):
        memory.added[0] += seen.period * seen.parameters.rate
        out.grip[0] = 30.0 + memory.added[0]
        lift = np.array([0.0, seen.model.object_mass * seen.model.gravity / len(seen.slip)])
        forces = out.grip[0] * seen.contact_normal + lift
        out.torque[:] = np.einsum("nij,ni->nj", seen.jacobian, forces)


class Stumble(Carry):
    """The same until it raises."""

    name = "stumble"

    def command(self, seen, memory, out):
        super().command(seen, memory, out)
        if seen.time > 0.1:
            raise RuntimeError("stumbled")


@pytest.fixture(params=[Carry, Stumble])
def recorded(request, tmp_path):
    """The run of a law, and its recording read after the law was forgotten."""
    law = request.param
    register_law(law)
    path = tmp_path / "run.mcap"
    result = simulate(with_values(BASE, {"controller.kind": law.name}))
    write_recording(result, path)
    forget(law.name)
    return result, open_recording(path)


def test_a_recording_says_which_law_it_was_and_what_it_answered(recorded):
    result, read = recorded
    assert read.provenance.law == result.provenance.law
    assert (read.provenance.law.version, len(read.provenance.law.digest)) == ("1.2", 64)
    assert read.ticks.to_rows().tobytes() == result.ticks.to_rows().tobytes()
    assert read.trace.to_rows().tobytes() == result.trace.to_rows().tobytes()
    column = next(c for c in columns_of(read.trace) if c.name == "law_grip")
    assert (column.unit, column.values[0]) == ("N", 30.002)


def test_it_verifies_bit_for_bit_without_the_law(recorded):
    _, read = recorded
    found = verify(read)
    assert (found.same, found.bit_for_bit, found.replayed) == (True, True, True)
    assert found.num_samples == len(read.trace) > 20


def test_a_command_that_was_altered_is_found(recorded):
    _, read = recorded
    rows = read.ticks.to_rows().copy()
    rows[50, 1] = np.nextafter(rows[50, 1], np.inf)
    ticks = Ticks.from_rows(read.trace.shape, rows)
    found = verify(replace(read, ticks=ticks))
    assert not found.same
    assert found.mismatches[0].time > 0.04


def test_with_the_law_its_code_is_run_as_well_and_must_be_the_same():
    law = register_law(Carry)
    result = simulate(with_values(BASE, {"controller.kind": "carry"}))
    found = verify(result, with_law=True)
    assert (found.same, found.replayed) == (True, False)
    other = replace(result.provenance, law=replace(law.identity, digest="0" * 64))
    found = verify(replace(result, provenance=other), with_law=True)
    assert [mismatch.what for mismatch in found.mismatches] == ["law"]
    forget("carry")


def test_a_run_that_changes_to_a_law_and_back_is_made_again_without_it(tmp_path):
    register_law(Carry)
    changes = (
        Change(time=0.1, parameter="controller.kind", value="carry"),
        Change(time=0.15, parameter="controller.parameters.rate", value=5.0),
        Change(time=0.2, parameter="controller.kind", value="grip-reflex"),
    )
    write_recording(simulate(replace(BASE, changes=changes)), tmp_path / "run.mcap")
    forget("carry")
    read = open_recording(tmp_path / "run.mcap")
    assert verify(read).same
    assert read.scenario.changes == changes


def test_a_run_that_was_stepped_from_outside_is_made_again_from_its_commands(tmp_path):
    simulation = Simulation(BASE)
    for tick in simulation.ticks():
        forces = (30.0 + np.sin(tick.seen.time)) * tick.seen.contact_normal
        forces[:, 1] += 0.5 * tick.seen.model.object_mass * tick.seen.model.gravity
        tick.torque = np.einsum("nij,ni->nj", tick.seen.jacobian, forces)
    write_recording(simulation.result(), tmp_path / "run.mcap")
    read = open_recording(tmp_path / "run.mcap")
    assert read.scenario.controller.kind == read.provenance.law.name == "outside"
    assert verify(read).same


def test_parameters_list_the_laws_of_the_run_whatever_else_is_known(tmp_path):
    alone = _parameters(simulate(BASE), tmp_path / "alone.mcap")
    register_law(Carry)
    assert _parameters(simulate(BASE), tmp_path / "beside.mcap") == alone
    own = _parameters(simulate(with_values(BASE, {LAW: "carry"})), tmp_path / "own.mcap")
    forget("carry")
    allowed = alone["controller.kind"]["allowed"]
    assert allowed == f"one of {', '.join(CONTROL_LAWS)}"
    assert own.pop("controller.kind")["allowed"] == f"{allowed}, carry"
    alone.pop("controller.kind")
    declared = {key: own.pop(key) for key in list(own) if key not in alone}
    assert own == alone
    assert set(declared) == {f"controller.parameters.{name}" for name in Carry.parameters}


def _parameters(result, path):
    """What the recording of a run says its parameters mean."""
    write_recording(result, path)
    with path.open("rb") as stream:
        documents = {found.name: found.data for found in make_reader(stream).iter_attachments()}
    return json.loads(documents["parameters.json"])
