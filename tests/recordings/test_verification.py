"""A recording is verified if, and only if, its scenario gives what it holds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slipgrasp.core.run.metrics import metrics_of_trace
from slipgrasp.core.run.numerics import SAME_BITS
from slipgrasp.core.run.simulator import Simulation, simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.columns import columns_of
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import Outcome, RunWarning
from slipgrasp.core.words.interruptions import describe_stop, describe_wall_limit
from slipgrasp.recordings.compare.comparison import compare
from slipgrasp.recordings.compare.verification import verify
from slipgrasp.recordings.exceptions import AlteredRecordingError
from slipgrasp.recordings.file.reader import read_back, read_recording, read_unfinished
from slipgrasp.recordings.file.writer import write_recording
from tests.recordings.tampering import patch_in_place, repack

DATA = Path(__file__).parent / "data"
OLD_RECORDINGS = sorted(DATA.glob("format-[123].mcap"))
SAMPLED = {"controller.control_period": 0.001, "simulation.duration": 6.0}
OTHER_KERNEL = "0123456789abcdef"
CONTACTS = "/slipgrasp/contacts"


@pytest.fixture
def recording(short_run, tmp_path):
    path = tmp_path / "run.mcap"
    write_recording(short_run, path)
    return path


@pytest.fixture(scope="module")
def whole_run():
    return simulate(with_values(load_scenario("paper-case-2"), SAMPLED))


def verify_file(path):
    read = read_back(path)
    return verify(read.result, unaltered=read.is_unaltered)


def cut_short(outcome, pieces=2):
    simulation = Simulation(with_values(load_scenario("paper-case-2"), SAMPLED))
    for _ in range(pieces):
        simulation.advance()
    reasons = {
        Outcome.STOPPED: describe_stop(simulation.time),
        Outcome.LIMIT: describe_wall_limit(simulation.time, 0.1),
    }
    simulation.end(outcome, reasons[outcome])
    return simulation.result()


def with_rows(run, change):
    rows = run.trace.to_rows().copy()
    rows = change(rows)
    return replace(run, trace=Trace.from_rows(run.trace.shape, rows))


def moved(run, name, row, step):
    """The run with one number moved, in units of its last place if the step is an integer."""
    place = [column.name for column in columns_of(run.trace)].index(name)

    def change(rows):
        old = rows[row, place]
        rows[row, place] = np.nextafter(old, np.inf) if isinstance(step, int) else old + step
        return rows

    return with_rows(run, change)


def elsewhere(run):
    """The run as if other machine code had computed it, and its metrics from its samples."""
    rate = run.scenario.simulation.output_rate
    metrics = metrics_of_trace(run.trace, run.phase_changes, run.outcome, rate)
    provenance = replace(run.provenance, kernel=OTHER_KERNEL)
    return replace(run, metrics=metrics, provenance=provenance, has_sample_metrics=True)


def mismatches(run):
    found = verify(run)
    assert not found.same
    return [mismatch.what for mismatch in found.mismatches]


def test_every_kind_of_run_is_verified_bit_for_bit(any_run, tmp_path):
    write_recording(any_run, tmp_path / "run.mcap")

    found = verify_file(tmp_path / "run.mcap")

    assert found.same and found.bit_for_bit and found.whole and found.unaltered
    assert found.mismatches == ()
    assert found.num_samples == len(any_run.trace)
    assert found.recorded == found.present == any_run.provenance


@pytest.mark.parametrize(
    "values", [{}, {"controller.latency": 0.002, "sensing.true_phases": False}]
)
def test_a_noisy_run_is_verified_bit_for_bit(values, tmp_path):
    """Noise comes from the seed that is part of the recorded scenario."""
    noisy = load_scenario("composite-case-2-noisy")
    scenario = with_values(noisy, {**values, "simulation.seed": 11, "simulation.duration": 0.6})
    write_recording(simulate(scenario), tmp_path / "run.mcap")
    found = verify_file(tmp_path / "run.mcap")
    assert found.same and found.bit_for_bit and found.whole


@pytest.mark.parametrize("outcome", [Outcome.STOPPED, Outcome.LIMIT])
def test_a_run_that_was_cut_short_is_verified_as_far_as_it_was_recorded(outcome):
    run = cut_short(outcome)

    found = verify(run)

    assert found.same and found.bit_for_bit and not found.whole
    assert found.end_time == run.end_time < 6.0
    last = len(run.trace) - 1
    assert mismatches(moved(run, "slip_1", last, 1)) == ["slip_1"]
    altered = replace(run, metrics=replace(run.metrics, torque_effort=1.0))
    assert mismatches(altered) == ["metrics"]
    assert verify(elsewhere(run)).same
    assert mismatches(elsewhere(replace(run, phase_changes=run.phase_changes[1:]))) == [
        "phase_changes"
    ]


def test_what_was_recovered_of_a_file_is_verified(whole_run, tmp_path):
    write_recording(whole_run, tmp_path / "run.mcap")
    data = (tmp_path / "run.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) * 2 // 3])
    run = read_unfinished(tmp_path / "cut.mcap").result
    assert run.outcome is Outcome.RECOVERED and len(run.trace) < len(whole_run.trace)

    assert verify(run).same
    assert mismatches(moved(run, "object_velocity_x", 50, 1)) == ["object_velocity_x"]
    altered = replace(run, metrics=replace(run.metrics, torque_effort=1.0))
    assert mismatches(altered) == ["metrics"]


@pytest.mark.parametrize("outcome", [Outcome.STOPPED, Outcome.LIMIT])
def test_a_whole_run_that_claims_to_be_cut_short_is_found(short_run, outcome):
    reason = describe_wall_limit(0.3, 1.0) if outcome is Outcome.LIMIT else describe_stop(0.3)
    claimed = replace(short_run, outcome=outcome, reason=reason)

    assert "outcome" in mismatches(claimed)


def test_one_bit_of_one_sample_is_found_though_the_mcap_library_made_all_checksums_fit(
    recording, short_run
):
    altered = recording.with_name("altered.mcap")
    repack(recording, altered, CONTACTS, 25)
    with pytest.raises(AlteredRecordingError):
        read_recording(altered)

    found = verify_file(altered)

    (mismatch,) = found.mismatches
    assert not found.same and not found.unaltered
    assert (mismatch.what, mismatch.time) == ("friction_coefficient_1", short_run.trace.times[25])
    assert mismatch.recorded != mismatch.computed == pytest.approx(mismatch.recorded, rel=1e-15)


def test_one_bit_patched_in_place_with_all_checksums_computed_anew_is_found(recording, short_run):
    altered = recording.with_name("altered.mcap")
    row = patch_in_place(recording, altered, "/slipgrasp/energy")
    assert altered.stat().st_size == recording.stat().st_size
    with pytest.raises(AlteredRecordingError):
        read_recording(altered)

    found = verify_file(altered)

    (mismatch,) = found.mismatches
    assert not found.same and not found.unaltered
    assert (mismatch.what, mismatch.time) == ("dissipated_energy", short_run.trace.times[row])


def test_one_bit_is_found_also_where_the_hashes_were_made_to_fit(short_run, tmp_path):
    write_recording(moved(short_run, "slip_velocity_0", 12, 1), tmp_path / "forged.mcap")
    read_recording(tmp_path / "forged.mcap")

    found = verify_file(tmp_path / "forged.mcap")

    (mismatch,) = found.mismatches
    assert found.unaltered and not found.same
    assert (mismatch.what, mismatch.time) == ("slip_velocity_0", short_run.trace.times[12])


def test_a_file_whose_hash_alone_does_not_fit_is_not_verified(short_run):
    found = verify(short_run, unaltered=False)

    assert not found.same and found.mismatches == ()


def test_the_column_that_differs_first_is_named_first(short_run):
    run = moved(moved(short_run, "x", 30, 1), "torque_1_1", 20, 1)

    assert mismatches(run) == ["torque_1_1", "x"]


ALTERATIONS = {
    "outcome": lambda run: replace(run, outcome=Outcome.SEPARATED),
    "warnings": lambda run: replace(
        run, warnings=(RunWarning(code="x", message="x", count=1, first_time=0.0),)
    ),
    "metrics": lambda run: replace(run, metrics=replace(run.metrics, held=not run.metrics.held)),
    "reason": lambda run: replace(run, reason=describe_stop(0.1)),
    "phase_changes": lambda run: replace(run, phase_changes=run.phase_changes[:-1]),
}


@pytest.mark.parametrize("what", ALTERATIONS)
def test_every_part_of_the_ending_is_compared(short_run, what):
    assert mismatches(ALTERATIONS[what](short_run)) == [what]


@pytest.mark.parametrize("what", ["outcome", "phase_changes"])
def test_other_machine_code_must_end_alike_too(short_run, what):
    assert mismatches(elsewhere(ALTERATIONS[what](short_run))) == [what]


def test_a_version_that_advises_otherwise_verifies_the_run():
    loose = {"controller.kind": "pd-gravity", "controller.grip_force": 1.0}
    lost = simulate(with_values(load_scenario("paper-case-2"), loose))
    assert lost.reason is not None
    advised = replace(lost, reason=replace(lost.reason, hint="press harder"))
    blamed = replace(lost, reason=replace(lost.reason, value=1.0))

    assert verify(advised).same
    assert mismatches(blamed) == ["reason"]


def test_samples_too_few_or_too_many_are_found(short_run):
    fewer = with_rows(short_run, lambda rows: rows[:-5])
    more = with_rows(short_run, lambda rows: np.concatenate([rows, rows[-1:]]))

    assert mismatches(fewer) == ["samples"]
    assert mismatches(more) == ["samples"]


def test_a_phase_change_moved_by_its_last_bit_is_found(short_run):
    *before, last = short_run.phase_changes
    run = replace(
        short_run, phase_changes=(*before, replace(last, time=np.nextafter(last.time, 1.0).item()))
    )

    assert mismatches(run) == ["phase_changes"]


def test_other_machine_code_is_held_to_the_tolerance(short_run):
    found = verify(elsewhere(short_run))

    assert found.same and not found.bit_for_bit
    assert found.recorded.kernel == OTHER_KERNEL != found.present.kernel


def test_a_run_of_an_earlier_version_that_had_the_same_bits_is_compared_bit_for_bit(
    short_run, monkeypatch
):
    earlier = replace(short_run, provenance=replace(short_run.provenance, kernel=OTHER_KERNEL))
    # What was the same as another version need not be the same as this one.
    monkeypatch.setitem(SAME_BITS, "numerics-of-another-version", (OTHER_KERNEL,))
    assert not verify(earlier).bit_for_bit
    monkeypatch.setitem(SAME_BITS, short_run.provenance.kernel, (OTHER_KERNEL,))
    found = verify(earlier)
    assert found.same and found.bit_for_bit
    assert mismatches(moved(earlier, "slip_0", 1, 1)) == ["slip_0"]


def test_columns_may_differ_by_the_tolerance_until_the_first_phase_change(short_run):
    first = min(c.time for c in short_run.phase_changes if c.time > 0.0)
    before, after = np.searchsorted(short_run.trace.times, first) + np.array([-2, 4])

    assert verify(elsewhere(moved(short_run, "slip_0", before, 0.9e-8))).same
    assert verify(elsewhere(moved(short_run, "slip_0", after, 1e-6))).same
    run = elsewhere(moved(short_run, "slip_0", before, 1.1e-8))
    (mismatch,) = verify(run).mismatches
    assert (mismatch.what, mismatch.time) == ("slip_0", short_run.trace.times[before])


def test_phase_changes_may_move_by_a_microsecond_but_not_change_their_order(short_run):
    def later(step):
        last = short_run.phase_changes[-1].time

        def change(rows):
            rows[rows[:, 0] == last, 0] += step
            return rows

        changes = [
            replace(change, time=change.time + step) if change.time == last else change
            for change in short_run.phase_changes
        ]
        return elsewhere(replace(with_rows(short_run, change), phase_changes=tuple(changes)))

    assert verify(later(0.9e-6)).same
    assert mismatches(later(1.1e-6)) == ["phase_changes"]
    swapped = (*short_run.phase_changes[:-2], *short_run.phase_changes[:-3:-1])
    assert mismatches(elsewhere(replace(short_run, phase_changes=swapped))) == ["phase_changes"]


def test_samples_at_other_times_do_not_escape_the_tolerance(short_run):
    def shift(rows):
        rows[1:10, 0] += 1e-5
        return rows

    assert "t" in mismatches(elsewhere(with_rows(short_run, shift)))


def test_another_end_is_found_elsewhere(whole_run):
    shorter = replace(whole_run, trace=whole_run.trace[:-3])

    assert mismatches(elsewhere(shorter)) == ["end_time"]


def test_the_progress_goes_up_to_one(whole_run):
    shares = []

    verify(whole_run, progress=shares.append)

    assert shares == sorted(shares) and shares[-1] == 1.0 and len(shares) > 2


@pytest.mark.parametrize("path", OLD_RECORDINGS, ids=lambda path: path.stem)
def test_a_recording_of_an_older_format_is_compared_in_what_it_holds(path):
    found = verify_file(path)
    assert found.same
    assert found.mismatches == ()
    old = read_recording(path)
    new = simulate(old.scenario)
    lacking = {c.name for c in columns_of(new.trace)} - {c.name for c in columns_of(old.trace)}
    assert lacking == {"input_rank"} | {
        f"{signal}_{axis}"
        for signal in ("external_wrench", "controllability")
        for axis in ("x", "y", "theta")
    } | {f"commanded_torque_{finger}_{joint}" for finger in (0, 1) for joint in (0, 1)}
    assert set(compare(old, new).only_b) == lacking
    assert not old.trace.to_pandas().columns.isin(lacking).any()
    assert "controllability" not in old.trace[1:].to_xarray()


def test_a_recording_of_the_present_format_lacks_nothing_and_comes_out_again():
    found = verify_file(DATA / "format-5.mcap")
    assert found.same and found.whole
    recorded = read_recording(DATA / "format-5.mcap")
    assert compare(recorded, simulate(recorded.scenario)).only_b == ()


def test_a_recording_of_other_machine_code_must_not_contradict_itself(short_run):
    forged = elsewhere(short_run)
    forged = replace(forged, metrics=replace(forged.metrics, torque_effort=1.0))

    (mismatch,) = verify(forged).mismatches

    assert (mismatch.what, mismatch.recorded) == ("metrics", "torque_effort 1.0")


def test_a_peak_force_below_that_of_a_sample_is_found_whatever_computed_the_run(short_run):
    least = tuple(0.9 * force for force in short_run.metrics.peak_normal_force)
    forged = replace(short_run, metrics=replace(short_run.metrics, peak_normal_force=least))
    elsewhere = replace(forged, provenance=replace(forged.provenance, kernel=OTHER_KERNEL))

    assert mismatches(forged) == ["metrics"]
    assert mismatches(elsewhere) == ["metrics", "metrics"]


def test_a_peak_force_above_all_samples_is_found_by_computing_the_run_again(short_run):
    more = tuple(1.1 * force for force in short_run.metrics.peak_normal_force)
    assert mismatches(
        replace(short_run, metrics=replace(short_run.metrics, peak_normal_force=more))
    ) == ["metrics"]
