"""Measured data as recordings: units, sampling, gaps, distances, and what is refused."""

import tracemalloc

import numpy as np
import pytest

from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.recordings.compare.comparison import IncomparableError
from slipgrasp.recordings.compare.measured import measure_distances
from slipgrasp.recordings.exceptions import DamagedRecordingError, NoRunError
from slipgrasp.recordings.measured import csv_import
from slipgrasp.recordings.measured.csv_import import ImportOptions, import_csv
from slipgrasp.recordings.measured.recording import (
    MeasuredRecording,
    read_measured,
    read_outline,
)
from slipgrasp.recordings.measured.table import MEASURED_TABLES
from slipgrasp.recordings.measured.units import ImportDataError
from slipgrasp.recordings.store.run_query import RunQuery
from slipgrasp.recordings.store.store import RecordingStore

MAPPING = {"t": "t_s", "x": "x_m"}


def table(folder, text):
    path = folder / "data.csv"
    path.write_text(text, encoding="utf-8")
    return path


def imported(folder, text, mapping=MAPPING, **options) -> MeasuredRecording:
    target = folder / "data.mcap"
    import_csv(table(folder, text), target, ImportOptions(mapping=mapping, **options))
    return read_measured(target)


@pytest.mark.parametrize(
    ("header", "mapped", "name", "factor"),
    [
        ("a", "a", "x", 1.0),
        ("a_mm", "a_mm", "x", 1e-3),
        ("a [cm]", "a [cm]", "x", 1e-2),
        ("slip left mm", "slip left mm", "slip_0", 1e-3),
        ("v mm/s", "v mm/s", "slip_velocity_0", 1e-3),
        ("a", "a:um", "slip_1", 1e-6),
        ("yaw_deg", "yaw_deg", "theta", np.pi / 180),
        ("w_deg_s", "w_deg_s", "object_velocity_theta", np.pi / 180),
        ("v", "v:mm/s", "slip_velocity_0", 1e-3),
        ("f_mN", "f_mN", "normal_force_0", 1e-3),
        ("tau", "tau:mNm", "torque_0_1", 1e-3),
        ("lift", "lift:mm", "joint_position_0_0", 1e-3),
        ("lift", "lift:deg", "joint_position_0_0", np.pi / 180),
    ],
)
def test_units_are_taken_from_the_mapping_or_from_the_end_of_the_name(
    tmp_path, header, mapped, name, factor
):
    found = imported(tmp_path, f"t_s,{header}\n0,1.5\n1,-2\n", {"t": "t_s", name: mapped})

    assert found.column(name).tolist() == [1.5 * factor, -2.0 * factor]


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_columns_may_be_separated_by_commas_semicolons_or_tabs(tmp_path, delimiter):
    rows = [["t_ms", " x_m "], ["0", "1"], ["5", " 2"], ["10", "4"]]
    text = "\r\n".join(delimiter.join(row) for row in rows)
    found = imported(tmp_path, f"﻿{text}", {"t": "t_ms", "x": "x_m"})

    assert found.times.tolist() == [0.0, 0.005, 0.01]
    assert found.column("x").tolist() == [1.0, 2.0, 4.0]


def test_a_gap_is_marked_and_even_sampling_is_told_from_uneven(tmp_path):
    times = [0.0, 0.1, 0.2, 0.7, 0.8, 0.9]
    text = "t_s,x_m\n" + "".join(f"{t},0\n" for t in times)
    even = imported(tmp_path, text).outline.sampling
    (tmp_path / "data.mcap").unlink()
    uneven = imported(tmp_path, text, longest_interval=1.0).outline.sampling

    assert (even.even, even.num_gaps, even.gaps) == (True, 1, ((0.2, 0.7),))
    assert even.period == pytest.approx(0.1)
    assert (uneven.even, uneven.num_gaps) == (False, 0)


def test_a_rate_stands_for_times_and_rows_left_out_leave_a_gap(tmp_path):
    text = "x_m\n0\n1\n\n2\n3\nnan\nnan\n6\n"
    # An empty line is no row; two rows without a value are.
    found = imported(tmp_path, text, {"x": "x_m"}, rate=10.0, start=1.0, skip_missing=True)

    assert found.times == pytest.approx([1.0, 1.1, 1.2, 1.3, 1.6])
    assert found.outline.sampling.num_gaps == 1


def test_every_nth_sample_is_kept_across_blocks(tmp_path, monkeypatch):
    monkeypatch.setattr(csv_import, "BLOCK_BYTES", 200)
    text = "t_s,x_m\n" + "".join(f"{i * 0.01},{i * 1e-3}\n" for i in range(100))
    found = imported(tmp_path, text, every=7)

    assert found.column("x") == pytest.approx(np.arange(0, 100, 7) * 1e-3)


def test_equal_tables_give_equal_files_and_their_samples_read_back_to_the_same_bits(tmp_path):
    rng = np.random.default_rng(3)
    times, values = np.cumsum(rng.uniform(0.01, 0.02, 9000)), rng.normal(0.0, 1e-3, 9000)
    rows = zip(times.tolist(), values.tolist(), strict=True)
    text = "t_s,x_m\n" + "".join(f"{t!r},{x!r}\n" for t, x in rows)
    found = imported(tmp_path, text)
    first = (tmp_path / "data.mcap").read_bytes()
    (tmp_path / "again").mkdir()
    imported(tmp_path / "again", text)

    assert np.array_equal(found.times, times)
    assert np.array_equal(found.column("x"), values)
    assert (tmp_path / "again" / "data.mcap").read_bytes() == first
    assert read_outline(tmp_path / "data.mcap") == found.outline


def test_a_changed_byte_of_a_measured_recording_is_noticed(tmp_path):
    imported(tmp_path, "t_s,x_m\n0,1\n1,2\n")
    data = bytearray((tmp_path / "data.mcap").read_bytes())
    place = data.index(b"slipgrasp/measured/stop") + 40
    data[place] ^= 1
    (tmp_path / "data.mcap").write_bytes(bytes(data))

    with pytest.raises(DamagedRecordingError):
        read_measured(tmp_path / "data.mcap")


@pytest.mark.parametrize(
    ("text", "mapping", "options", "words"),
    [
        ("t_s,x_m\n0,1\n", MAPPING | {"y": "y_m"}, {}, ["y=y_m", "not in the table", "t_s, x_m"]),
        ("t_s,x_m,x_m\n0,1,1\n", MAPPING, {}, ["x_m", "twice"]),
        ("t_s,x_m\n0,1\n", {"t": "t_s", "slip": "x_m"}, {}, ["'slip'", "not a signal"]),
        ("t_s,x_m\n0,1\n", {"t": "t_s", "x": "x_m:deg"}, {}, ["'deg'", "mm"]),
        ("t_s,x_m\n0,1\n1,nan\n", MAPPING, {}, ["row 3", "x_m", "no value", "--skip-missing"]),
        ("t_s,x_m\n0,1\n1,\n", MAPPING, {}, ["row 3", "no value", "--skip-missing"]),
        ("t_s,x_m\n0,1\n1,inf\n", MAPPING, {}, ["row 3", "inf"]),
        ("t_s,x_m\n0,1\n1,1 mm\n", MAPPING, {}, ["row 3", "'1 mm'", "not a number"]),
        ("t_s,x_m\n0,1\n1,1\n0.5,1\n", MAPPING, {}, ["row 4", "from 1 s to 0.5 s", "sort"]),
        ("t_s,x_m\n0,1\n0,1\n", MAPPING, {}, ["row 3", "from 0 s to 0 s", "increase"]),
        ("t_s,x_m\n-1,1\n0,1\n", MAPPING, {}, ["row 2", "-1 s", "--start 0"]),
        ("t_s,x_m\n0,1\n1\n", MAPPING, {}, ["cannot be read as a table"]),
        ("t_s,x_m\n0,1\n", MAPPING, {}, ["1 samples", "at least 2"]),
        ("stamp,x_m\n0,1\n", {"x": "x_m"}, {}, ["no times", "--rate"]),
        ("t,time,x_m\n0,0,1\n", {"x": "x_m"}, {}, ["no times", "--rate"]),
        ("t_s,x_m\n0,1\n", MAPPING, {"rate": 10.0}, ["both", "--rate"]),
        ("t_s,x\n0,52\n1,53\n", {"t": "t_s", "x": "x"}, {}, ["53 m", "5 m", "x=x:mm", "x=x:m'"]),
        ("t_s,s\n0,2\n1,1\n", {"t": "t_s", "slip_0": "s"}, {}, ["2 m", "0.5 m", "slip_0=s:mm"]),
        ("t_s,a\n0,2\n1,90\n", {"t": "t_s", "theta": "a"}, {}, ["90 rad", "theta=a:deg"]),
        ("t,x_m\n0,1\n10,1\n", {"t": "t", "x": "x_m"}, {}, ["10 s apart", "t=t:ms"]),
        ("", MAPPING, {}, ["no header"]),
    ],
)
def test_bad_input_is_refused_in_a_sentence_and_leaves_no_file(
    tmp_path, text, mapping, options, words
):
    with pytest.raises(ImportDataError) as caught:
        imported(tmp_path, text, mapping, **options)

    assert [word for word in words if word not in str(caught.value)] == []
    assert [path.name for path in tmp_path.iterdir()] == ["data.csv"]


@pytest.mark.parametrize(
    ("header", "factor"),
    [("t", 1.0), ("time", 1.0), ("t_ms", 1e-3), ("Time [ms]", 1e-3), ("time (s)", 1.0)],
)
def test_times_are_in_the_column_of_that_name(tmp_path, header, factor):
    found = imported(tmp_path, f"{header},x_m\n0,1\n0.1,1\n", {"x": "x_m"})

    np.testing.assert_allclose(found.times, [0.0, 0.1 * factor])


def test_a_stated_unit_is_taken_whatever_the_size(tmp_path):
    found = imported(tmp_path, "t_s,x\n0,52\n1,53\n", {"t": "t_s", "x": "x:m"})

    assert found.column("x").tolist() == [52.0, 53.0]


def test_a_table_with_too_many_numbers_is_refused_with_the_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(csv_import, "MAX_NUMBERS", 100)
    text = "t_s,x_m\n" + "".join(f"{i},0\n" for i in range(51))

    with pytest.raises(ImportDataError, match=r"more than 50 samples of 1 signals.*--every"):
        imported(tmp_path, text)
    assert len(imported(tmp_path, text, every=2).times) == 26


def test_a_longer_table_takes_no_more_memory(tmp_path):
    def peak(rows):
        text = "t_s,x_m\n" + "".join(f"{i * 0.01:.2f},0.001\n" for i in range(rows))
        path = table(tmp_path, text)
        del text
        tracemalloc.start()
        import_csv(path, tmp_path / f"{rows}.mcap", ImportOptions(mapping=MAPPING))
        _, most = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return most

    peak(1000)
    assert peak(400_000) < 1.3 * peak(150_000)


@pytest.fixture(scope="module")
def run(kernel):
    return simulate(with_values(load_scenario("paper-case-2"), {"simulation.duration": 1.0}))


def measured_of(run, names, noise=None):
    """Measured data that are the samples of a run, in a table and back."""
    columns = {column.name: np.asarray(column.values, float) for column in columns_of(run.trace)}
    keep = np.concatenate([[True], np.diff(columns["t"]) > 0.0])
    extra = 0.0 if noise is None else noise
    rows = np.column_stack([columns["t"][keep], *(columns[n][keep] + extra for n in names)])
    head = ",".join(["t", *names])
    return head + "\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows.tolist())


def test_the_distance_of_a_run_from_its_own_samples_is_zero_and_of_shifted_ones_the_shift(
    tmp_path, run
):
    names = ["x", "y", "slip_0"]
    mapping = {name: name for name in ("t", *names)}
    exact = imported(tmp_path, measured_of(run, names), mapping)
    (tmp_path / "data.mcap").unlink()
    shifted = imported(tmp_path, measured_of(run, names, noise=1e-3), mapping)

    assert all(each.max == 0.0 for each in measure_distances(exact, run).signals.values())
    assert measure_distances(exact, run).within(0.0)
    for each in measure_distances(shifted, run).signals.values():
        assert each.mean == pytest.approx(-1e-3)
        assert each.rms == pytest.approx(1e-3)
    assert measure_distances(shifted, exact).signals["x"].max == pytest.approx(1e-3)


def test_data_without_a_signal_or_a_time_in_common_are_not_compared(tmp_path, run):
    other = imported(tmp_path, "t_s,z\n0,1\n1,2\n", {"t": "t_s", "z": "z"})
    (tmp_path / "data.mcap").unlink()
    later = imported(tmp_path, "t_s,x\n9,1\n9.5,2\n", {"t": "t_s", "x": "x"})

    with pytest.raises(IncomparableError, match="none of which"):
        measure_distances(other, run)
    with pytest.raises(IncomparableError, match=r"9 to 9\.5 s"):
        measure_distances(later, run)


def test_measured_data_are_listed_as_such_and_opened_as_no_run(tmp_path, run):
    store = RecordingStore(tmp_path / "data")
    place = store.reserve()
    options = ImportOptions(mapping=MAPPING, title="slides")
    outline = import_csv(table(tmp_path, "t_s,x_m\n0,1\n1,2\n"), place.path, options)
    store.register_measured(place, outline)
    store.save(run)

    again = RecordingStore(tmp_path / "data")
    (listed,) = again.find(RunQuery(controller="measured")).runs
    assert (listed.id, listed.is_measured, listed.name) == (place.id, True, "slides")
    assert "measured x; 2 samples" in listed.title
    assert [each.is_measured for each in again.list()] == [False, True]
    assert again.find(RunQuery(limit=5)).count == 2
    with pytest.raises(NoRunError, match="contains measured data, not a run"):
        again.open(place.id)


def test_tables_of_measured_data_have_their_numbers_and_units(tmp_path):
    found = imported(tmp_path, "t_s,x_mm\n0,1.7\n1,2\n", {"t": "t_s", "x": "x_mm"})
    for name, write in MEASURED_TABLES.items():
        with (tmp_path / f"out.{name}").open("wb") as stream:
            write(found, stream)

    from pyarrow import parquet

    text = (tmp_path / "out.csv").read_text()
    assert text.splitlines()[:2] == ["t,x", f"0.0,{1.7e-3!r}"]
    arrays = np.load(tmp_path / "out.npz")
    assert arrays["x"].tolist() == [1.7e-3, 2e-3]
    read = parquet.read_table(tmp_path / "out.parquet")
    assert read.column("x").to_pylist() == [1.7e-3, 2e-3]
    assert read.schema.field("x").metadata == {b"unit": b"m"}
