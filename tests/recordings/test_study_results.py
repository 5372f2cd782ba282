import csv
import io
import json
import threading

import numpy as np
import pytest
from pyarrow import parquet

from slipgrasp.core.run.metrics import metric_names
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.exceptions import QueryError
from slipgrasp.recordings.study.categories import HELD, PAST_LIMIT, categorize
from slipgrasp.recordings.study.map_axes import compared_keys
from slipgrasp.recordings.study.results import StudyResults, read_results
from slipgrasp.recordings.study.study_row import StudyRow
from tests.recordings.studying import make_study, run_study

SAMPLED = {
    "title": "heavier and smoother",
    "sampling": {"method": "random", "runs": 15, "seed": 4},
    "vary": {
        "object.mass": {"min": 0.5, "max": 8.0},
        "fingers.*.friction": {"min": 0.1, "max": 1.0},
        "controller.lyapunov_weight": {"values": [1.0, 20.0]},
    },
}


@pytest.fixture(scope="module")
def study():
    return make_study(**SAMPLED)


@pytest.fixture(scope="module")
def study_file(study, tmp_path_factory):
    path = tmp_path_factory.mktemp("study") / "study.mcap"
    run_study(study, path)
    return path


@pytest.fixture(scope="module")
def results(study_file):
    return read_results(study_file)


def lost_row(index, values):
    return StudyRow(
        index=index,
        values=values,
        outcome=Outcome.FAILED,
        reason=None,
        end_time=0.0,
        metrics={},
        state_hash="",
        kernel="",
    )


def test_there_is_one_row_per_run_with_everything_about_it(study, results):
    assert results.num_rows == study.num_runs == 30
    assert results.column_names == (
        *("index", "sample"),
        *("object.mass", "fingers.*.friction", "controller.lyapunov_weight"),
        *("outcome", "reason", "reason_message", "end_time"),
        *metric_names(2),
        *("state_hash", "kernel", "recording"),
    )
    kinds = set(results.values("outcome"))
    assert {"completed", "left_face"} <= kinds, "the study shows runs that hold and that do not"


@pytest.mark.parametrize("metric", ["slip_path", "slip_path_1", "final_tracking_error_y"])
def test_an_object_past_a_limit_of_the_study_counts_as_not_held(results, tmp_path, metric):
    columns = [name for name in results.column_names if name.startswith(metric)]
    largest = np.max([np.abs(results.numbers(name)) for name in columns], axis=0)
    held = results.numbers("held") == 1.0
    limit = float(np.median(largest[held]))
    run_study(make_study(**SAMPLED, limits={metric: limit}), tmp_path / "study.mcap")
    limited = read_results(tmp_path / "study.mcap")

    assert limited.study.limits == {metric: limit}
    np.testing.assert_array_equal(limited.numbers("held") == 1.0, held & (largest <= limit))
    np.testing.assert_array_equal(categorize(limited) == HELD, held & (largest <= limit))
    is_past = categorize(limited) == PAST_LIMIT
    assert is_past[held & (largest > limit)].all()
    assert {limited.row(k)["outcome"] for k in np.flatnonzero(is_past)} == {"completed"}
    assert limited.values("state_hash") == results.values("state_hash")


def test_rows_come_page_by_page_in_the_order_of_any_column(results):
    everything, count = results.rows(sort="-slip_path_0")
    page, same_count = results.rows(10, 5, sort="-slip_path_0")

    slips = [row["slip_path_0"] for row in everything]
    assert slips == sorted(slips, reverse=True)
    assert (page, count, same_count) == (everything[10:15], 30, 30)


def test_rows_without_a_value_come_last_and_equal_ones_in_the_order_of_their_runs(results):
    for sort in ("reason", "-reason"):
        rows, _ = results.rows(sort=sort)
        known = [row["reason"] for row in rows if row["reason"] is not None]
        assert known == sorted(known, reverse=sort.startswith("-"))
        assert [row["reason"] for row in rows] == known + [None] * (len(rows) - len(known))
        last = [row["index"] for row in rows if row["reason"] is None]
        assert last == sorted(last)
    margins, _ = results.rows(sort="-minimum_friction_margin_0")
    known = [row["minimum_friction_margin_0"] for row in margins]
    assert None in known
    assert None not in known[: known.index(None)]
    assert set(known[known.index(None) :]) == {None}


def test_rows_are_chosen_by_outcome_and_by_whether_they_hold(results):
    held, num_held = results.rows(held=True)
    lost, num_lost = results.rows(outcome="left_face", held=False, limit=1)

    assert num_held == len(held) == sum(results.values("held"))
    assert num_lost == results.values("outcome").count("left_face") > 1
    assert len(lost) == 1
    assert all(row["held"] for row in held)


@pytest.mark.parametrize(
    ("asked", "finding"),
    [
        ({"sort": "-mass"}, "'mass' is not a column"),
        ({"outcome": "lost"}, "'lost' is not an outcome"),
    ],
)
def test_what_there_is_not_is_refused_with_what_there_is(results, asked, finding):
    with pytest.raises(QueryError, match=finding) as error:
        results.rows(**asked)
    assert "completed" in error.value.known or "object.mass" in error.value.known


def test_the_first_rows_stay_as_they_are_while_others_come(study, results):
    growing = StudyResults(study)
    rows = [lost_row(index, study.values_of(index)) for index in range(3)]
    for row in rows[:2]:
        growing.append(row)
    first = growing.first(2)
    growing.append(rows[2])
    assert (first.num_rows, growing.num_rows) == (2, 3)
    assert first.rows() == (growing.rows()[0][:2], 2)
    assert len(first.numbers("end_time")) == first.summary().finished == 2
    assert growing.first(9).num_rows == 3


def test_a_run_that_has_not_ended_has_no_row(study):
    with pytest.raises(IndexError):
        StudyResults(study).row(0)


def test_a_row_out_of_order_is_refused(study):
    with pytest.raises(ValueError, match="row 3 cannot follow 0 rows"):
        StudyResults(study).append(lost_row(3, {}))


def test_a_run_that_could_not_be_simulated_has_a_row_without_figures(study):
    results = StudyResults(study)
    results.append(lost_row(0, study.values_of(0)))

    row = results.row(0)
    assert row["outcome"] == "failed"
    assert {row[name] for name in metric_names(2)} == {None}
    assert results.summary().metrics == {}
    assert results.rows(held=False)[1] == 1


def test_readers_see_whole_rows_while_others_are_added(study):
    study = make_study(**{**SAMPLED, "sampling": {"method": "random", "runs": 1000}})
    results = StudyResults(study)
    torn, done = [], threading.Event()

    def read():
        while not done.is_set():
            rows, count = results.rows(sort="-index")
            if [row["index"] for row in rows] != list(range(count))[::-1]:
                torn.append(count)

    reader = threading.Thread(target=read)
    reader.start()
    try:
        for index in range(study.num_runs):
            results.append(lost_row(index, study.values_of(index)))
    finally:
        done.set()
        reader.join()
    assert torn == []
    assert results.values("object.mass")[-1] == study.values_of(1999)["object.mass"]


def test_csv_reads_back_to_the_same_bits(results):
    stream = io.StringIO()
    results.write_csv(stream)

    rows = list(csv.DictReader(io.StringIO(stream.getvalue())))
    assert list(rows[0]) == list(results.column_names)
    for written, row in zip(rows, results.rows()[0], strict=True):
        assert float(written["slip_path_1"]) == row["slip_path_1"]
        assert float(written["object.mass"]) == row["object.mass"]
        assert written["held"] == json.dumps(row["held"])
        assert written["reason"] == (row["reason"] or "")
        assert written["recording"] == ""


def test_parquet_has_the_same_numbers_with_their_units_and_the_study(results, study):
    stream = io.BytesIO()
    results.write_parquet(stream)

    table = parquet.read_table(io.BytesIO(stream.getvalue()))
    assert table.to_pylist() == results.rows()[0]
    units = {field.name: field.metadata[b"unit"].decode() for field in table.schema}
    assert units["object.mass"] == "kg"
    assert units["slip_path_0"] == "m"
    assert units["final_tracking_error_theta"] == "rad"
    assert units["minimum_friction_margin_1"] == "N"
    again = json.loads(table.schema.metadata[b"slipgrasp.study"])
    assert again["vary"].keys() == set(study.keys)


def test_json_is_one_document_with_units_and_rows(results):
    stream = io.StringIO()
    results.write_json(stream)

    document = json.loads(stream.getvalue())
    assert document["title"] == "heavier and smoother"
    assert (document["base"], document["runs"]) == ("paper-case-1", 30)
    assert document["columns"]["torque_effort"] == "N² m² s"
    assert document["rows"] == results.rows()[0]


def test_the_summary_counts_and_has_the_quantiles_of_every_outcome(results):
    summary = results.summary()
    outcomes = results.values("outcome")

    assert sum(summary.outcomes.values()) == summary.finished == 30
    assert summary.held == sum(results.values("held"))
    assert summary.share_held == summary.held / 30
    assert sum(summary.reasons.values()) == 30 - outcomes.count("completed")
    slips = results.numbers("slip_path_0")
    spread = summary.metrics["slip_path_0"]
    assert (spread.minimum, spread.median, spread.maximum, spread.runs) == (
        *(slips.min(), np.median(slips), slips.max(), 30),
    )
    lost = slips[[word == "left_face" for word in outcomes]]
    assert summary.metrics_by_outcome["left_face"]["slip_path_0"].percentile_95 == np.quantile(
        lost, 0.95
    )
    assert "held" not in summary.metrics


def test_combinations_are_compared_on_the_same_samples(results):
    compared = results.compare_combinations()

    assert compared.keys == ("controller.lyapunov_weight",)
    slow, fast = compared.combinations
    assert slow.values == {"controller.lyapunov_weight": 1.0}
    assert (slow.runs, fast.runs) == (15, 15)
    held = np.array(results.values("held")).reshape(15, 2)
    pair = compared.pairs[0]
    assert (slow.held, fast.held) == tuple(held.sum(axis=0))
    assert pair.held_by_both == np.count_nonzero(held[:, 0] & held[:, 1])
    assert pair.held_by_second == np.count_nonzero(~held[:, 0] & held[:, 1]) > 0
    assert pair.held_by_first == np.count_nonzero(held[:, 0] & ~held[:, 1])
    assert pair.held_by_both + pair.held_by_first + pair.held_by_second + pair.held_by_neither == 15
    assert fast.medians["slip_path_0"] == np.median(results.numbers("slip_path_0")[1::2])


def test_runs_too_short_to_tell_count_neither_as_held_nor_as_lost(tmp_path):
    """Of two durations one is too short for all that do not slip; those are not compared."""
    vary = {"simulation.duration": {"values": [0.1, 0.6]}, "object.mass": {"min": 0.5, "max": 1.0}}
    short = make_study(**{**SAMPLED, "vary": vary})
    run_study(short, tmp_path / "study.mcap")
    results = read_results(tmp_path / "study.mcap")
    summary = results.summary()
    assert summary.too_short == results.values("held").count(None) > 0
    assert 0 < summary.share_held == summary.held / (30 - summary.too_short)
    compared = results.compare_combinations()
    one, other = compared.combinations
    assert (one.held, one.share_held, one.too_short) == (0, 0.0, summary.too_short)
    assert (other.too_short, other.share_held) == (0, other.held / 15)
    assert compared.pairs[0].samples == 15 - one.too_short


def test_values_of_several_kinds_and_of_some_runs_only_are_kept_as_they_are():
    study = make_study(
        sampling={"method": "list"},
        runs=[
            {"controller.position_gain": [100.0, 90.0, 80.0]},
            {"controller.position_gain": 50.0, "simulation.max_steps": 1000},
            {"controller.kind": "theorem-4"},
        ],
    )
    results = StudyResults(study)
    for index in range(3):
        results.append(lost_row(index, study.values_of(index)))

    assert results.values("controller.position_gain") == [[100.0, 90.0, 80.0], 50.0, None]
    assert results.values("controller.kind") == [None, None, "theorem-4"]
    ordered = [row["index"] for row in results.rows(sort="controller.position_gain")[0]]
    assert ordered == [1, 0, 2]
    stream = io.StringIO()
    results.write_csv(stream)
    cells = [
        row["controller.position_gain"] for row in csv.DictReader(io.StringIO(stream.getvalue()))
    ]
    assert cells == ["[100.0, 90.0, 80.0]", "50.0", ""]


def test_too_many_combinations_are_not_compared():
    study = make_study(
        vary={
            "controller.kind": {"values": ["theorem-3", "theorem-4"]},
            "object.mass": {"values": [1.0 + 0.1 * k for k in range(20)]},
        },
    )
    assert compared_keys(study) == ()
    assert StudyResults(study).compare_combinations() is None
