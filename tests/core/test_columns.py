"""Every signal is a set of named columns with units, and a frame of pandas or xarray."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, preset_names, with_values
from slipgrasp.core.scenario.space import PLANAR, SPATIAL
from slipgrasp.core.trace.columns import columns_of, short_columns
from slipgrasp.core.trace.frames import MissingPackageError
from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.core.trace.types import ContactPhase


@pytest.fixture(scope="module")
def trace():
    short = {"simulation.duration": 0.2}
    return simulate(with_values(load_scenario("paper-case-2"), short)).trace


@pytest.fixture(scope="module")
def columns(trace):
    return {column.name: column for column in columns_of(trace)}


def test_all_columns_together_are_the_rows_of_the_trace(trace, columns):
    assert len(columns) == trace.shape.num_columns
    table = np.stack([column.values for column in columns.values()], axis=1)
    assert table.tobytes() == trace.to_rows().tobytes()


def test_the_short_table_consists_of_some_of_them(trace, columns):
    short = short_columns(trace)

    assert {column.name for column in short} < columns.keys()
    assert all(np.shares_memory(c.values, columns[c.name].values) for c in short)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("t", "s"),
        ("theta", "rad"),
        ("object_velocity_x", "m/s"),
        ("object_acceleration_y", "m/s²"),
        ("object_acceleration_theta", "rad/s²"),
        ("error_y", "m"),
        ("phase_0", ""),
        ("friction_margin_1", "N"),
        ("torque_1_0", "N m"),
        ("estimate_object.mass", "kg"),
        ("true_parameter_object.inertia", "kg m²"),
        ("estimate_fingers.1.friction", "1"),
        ("kinetic_energy", "J"),
    ],
)
def test_a_column_has_its_name_and_unit(columns, name, unit):
    assert columns[name].unit == unit


def test_a_pandas_frame_holds_every_column_by_time(trace, columns):
    frame = trace.to_pandas()

    assert frame.index.name == "t"
    assert frame.index.to_numpy().tobytes() == trace.times.tobytes()
    assert list(frame.columns) == list(columns)[1:]
    assert frame.attrs["units"] == {name: column.unit for name, column in columns.items()}
    assert frame["torque_1_0"].to_numpy().tobytes() == columns["torque_1_0"].values.tobytes()
    labels = [ContactPhase(phase).label for phase in trace.phase[:, 1]]
    assert list(frame["phase_1"]) == labels
    assert set(labels) == {"stick", "slip_backward"}


def test_an_xarray_dataset_holds_every_signal_with_dimensions_and_units(trace):
    dataset = trace.to_xarray()

    for signal in filter(trace.shape.has, SIGNALS[1:]):
        assert dataset[signal.name].values.tobytes() == (
            np.ascontiguousarray(getattr(trace, signal.name)).tobytes()
        )
    assert dataset["slip"].dims == ("time", "contact")
    assert dataset["slip"].attrs["units"] == "m"
    assert dataset["object_pose"].attrs["units"] == "m, m, rad"
    assert dataset["estimates"].sel(unknown="object.mass").values[0] == 0.5
    assert dataset["joint_torque"].sel(joint="1_0").values[-1] == trace.joint_torque[-1, 2]
    assert list(dataset["coordinate"].values) == ["x", "y", "theta"]
    assert dataset["time"].attrs["units"] == "s"


def test_a_trace_without_unknowns_has_an_empty_dimension_for_them(trace):
    scenario = replace(load_scenario("paper-case-1"), estimates=())
    known = simulate(with_values(scenario, {"simulation.duration": 0.01})).trace

    assert known.to_xarray().sizes["unknown"] == 0
    assert not [name for name in known.to_pandas() if name.startswith("estimate_")]


@pytest.mark.parametrize(("package", "convert"), [("pandas", "to_pandas"), ("xarray", "to_xarray")])
def test_a_package_that_is_not_installed_is_named(trace, monkeypatch, package, convert):
    monkeypatch.setitem(sys.modules, package, None)

    with pytest.raises(MissingPackageError, match=f"^{package} is not installed; 'pip install"):
        getattr(trace, convert)()


@pytest.mark.parametrize("space", [PLANAR, SPATIAL])
def test_every_signal_is_written(space):
    """A signal whose row is forgotten in one mechanics would be 0 there."""
    moved, known = set(), set()
    for name in preset_names(space):
        for column in columns_of(simulate(load_scenario(name)).trace):
            known.add(column.signal)
            if np.nan_to_num(column.values).any():
                moved.add(column.signal)
    # No preset violates the grasp conditions, and no planar one has a pulse.
    assert known - moved <= {"grasp_violation", "external_wrench"}
    assert space is PLANAR or "external_wrench" in moved
