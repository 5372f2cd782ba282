import csv
import io

import numpy as np
import pytest

from slipgrasp.core.trace.columns import short_columns
from slipgrasp.core.trace.types import ContactPhase
from slipgrasp.recordings.export import write_csv

COLUMNS = [
    *("t", "x", "y", "theta", "error_x", "error_y", "error_theta"),
    *("slip_0", "slip_velocity_0", "phase_0", "normal_force_0", "tangential_force_0"),
    *("slip_1", "slip_velocity_1", "phase_1", "normal_force_1", "tangential_force_1"),
    *("torque_0_0", "joint_position_0_0", "torque_0_1", "joint_position_0_1"),
    *("torque_1_0", "joint_position_1_0", "torque_1_1", "joint_position_1_1"),
    *("estimate_fingers.0.friction", "estimate_fingers.1.friction"),
    *("estimate_object.mass", "estimate_object.inertia"),
]


@pytest.fixture(scope="module")
def table(short_run):
    text = io.StringIO()
    write_csv(short_run, text)
    return list(csv.DictReader(io.StringIO(text.getvalue())))


def numbers(table, name):
    return np.array([float(row[name]) for row in table])


def test_the_columns_are_those_of_the_contract(short_run, table):
    assert list(table[0]) == COLUMNS


def test_every_number_reads_back_to_the_same_bits(short_run, table):
    trace = short_run.trace
    expected = {
        "t": trace.times,
        "theta": trace.object_pose[:, 2],
        "error_y": trace.tracking_error[:, 1],
        "slip_velocity_1": trace.slip_velocity[:, 1],
        "normal_force_0": trace.normal_force[:, 0],
        "tangential_force_1": trace.tangential_force[:, 1],
        "torque_1_0": trace.joint_torque[:, 2],
        "joint_position_0_1": trace.joint_position[:, 1],
        "estimate_object.mass": trace.estimates[:, 2],
    }
    for name, values in expected.items():
        assert numbers(table, name).tobytes() == values.tobytes(), name


def test_phases_are_words(short_run, table):
    for contact in range(2):
        words = [row[f"phase_{contact}"] for row in table]
        assert words == [ContactPhase(p).label for p in short_run.trace.phase[:, contact]]
    assert {row["phase_0"] for row in table} == {"stick", "slip_forward"}
    assert {row["phase_1"] for row in table} == {"stick", "slip_backward"}


def test_an_event_gives_two_rows_with_the_same_time(short_run, table):
    times = [row["t"] for row in table]
    for change in short_run.phase_changes:
        assert times.count(repr(change.time)) == 2
        before = times.index(repr(change.time))
        phases = [row[f"phase_{change.contact}"] for row in table[before : before + 2]]
        assert phases == [change.from_phase.label, change.to_phase.label]


def test_a_run_without_unknowns_has_no_estimates(run_without_unknowns):
    names = [column.name for column in short_columns(run_without_unknowns.trace)]
    assert not any(name.startswith("estimate_") for name in names)
