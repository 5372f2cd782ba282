"""Robustness of recordings: kills, cuts, flipped bits, bombs, failing disks, power cuts.

Every campaign is seeded and raises `AssertionError` at the first fault;
the tests run a small sample of each.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from benchmarks.faults.bombs import defuse_all
from benchmarks.faults.clients import hold_connections, read_signals
from benchmarks.faults.clock import LARGEST_JUMP, jump_while_serving
from benchmarks.faults.damage import cut_everywhere, flip_bits
from benchmarks.faults.disk import cut_the_power, fail_every_write
from benchmarks.faults.full_disk import fill_the_disk
from benchmarks.faults.kills import kill_writers
from benchmarks.faults.services import kill_services, restart_with_unfinished
from benchmarks.faults.stops import stop_runs
from benchmarks.faults.viewers import mix_viewers
from benchmarks.faults.workers import kill_in_a_burst, kill_workers
from benchmarks.report import Table

__all__ = ["run"]

KILLS = 100
SERVICE_KILLS = 20
SURVIVOR_KILLS, LAST_SECOND_KILLS = 50, 20
WORKER_KILLS = 100
DASK_KILLS, DASK_RUNS = 4, 2000
BURST, BURST_SECONDS = 6, 4.0
UNWRITABLE_RUNS = 7
FLIPS = 2000
CLOCK_RUNS = 50
STOPS = 40
IDLE, SLOW, CROWD_SECONDS = 1500, 200, 20.0
UNFINISHED, UNFINISHED_DURATION = 10, 50.0
POLITE, RUDE, ROUNDS, WATCH_SECONDS = 56, 8, 4, 8.0
READERS, READ_DURATION, READ_SIGNALS = 40, 57.0, "t,slip,phase_0"

Row = tuple[str, str]


def run(_docs: Path | None = None) -> list[Table]:
    """The tables ``faults`` and ``bombs``; each row is printed as soon as it is measured."""
    rows = []
    for campaign in CAMPAIGNS:
        rows.append(campaign())
        print(": ".join(rows[-1]), flush=True)
    return [Table("faults", ("what happens", "what is left"), tuple(rows)), defuse_all()]


def _killed_writers() -> Row:
    kills = kill_writers(KILLS, seed=1)
    return (
        "SIGKILL while a run is written, at a random moment",
        f"{kills.count} of {kills.count} still writing, {kills.readable} readable up to the "
        f"last flush ({kills.fewest} to {kills.most} samples)",
    )


def _killed_services() -> Row:
    services = kill_services(SERVICE_KILLS, seed=1)
    return (
        "SIGKILL of a service that records two runs",
        f"{services.count} of {services.count} restarted, all {services.recovered} runs listed "
        f"as recovered, after {services.slowest:.1f} s at most",
    )


def _survivors() -> Row:
    # Also a main program, which must not be imported before it is run.
    from benchmarks.faults.survivors import kill_and_compare

    found = kill_and_compare(SURVIVOR_KILLS, LAST_SECOND_KILLS, seed=1)
    return (
        f"SIGKILL of a run or a service, {SURVIVOR_KILLS} at a random instant and "
        f"{LAST_SECOND_KILLS} in the last second of a recording",
        f"{found.whole} complete recordings with the bytes of an undisturbed run, {found.laid_out} "
        f"of them finished by recovery; {found.recovered} recovered as a prefix, {found.nothing} "
        "without a sample yet",
    )


def _killed_workers() -> Row:
    workers = kill_workers(WORKER_KILLS, seed=1)
    return (
        "SIGKILL of the workers of a study, again and again",
        f"{workers.count} killed, {workers.runs} of {workers.runs} runs done exactly once: "
        "the same file as undisturbed",
    )


def _killed_dask_workers() -> Row:
    workers = kill_workers(DASK_KILLS, seed=1, runs=DASK_RUNS, engine="dask")
    return (
        "SIGKILL of the workers of a Dask cluster",
        f"{workers.count} killed, {workers.runs} of {workers.runs} runs done exactly once: "
        "the same file as undisturbed in processes",
    )


def _burst() -> Row:
    burst = kill_in_a_burst(BURST, BURST_SECONDS)
    return (
        f"SIGKILL of {BURST} workers of a study within {BURST_SECONDS:g} s",
        f"{BURST} killed within {burst:.1f} s, the same file as undisturbed",
    )


def _full_disk() -> Row:
    full = fill_the_disk(UNWRITABLE_RUNS)
    return (
        f"{2 * UNWRITABLE_RUNS} runs over REST while the disk is full",
        f"{full.refused} refused with 507 before, of which {full.left} files are left; "
        f"{full.failed} cut off and failed with the reason disk; 0 reported as completed",
    )


def _cuts() -> Row:
    cuts = cut_everywhere()
    return (
        "cut off after every byte",
        f"{cuts.finished} of a whole file refused; of an unfinished one {cuts.prefixes} read "
        f"as a prefix, {cuts.empty} hold no sample yet and say so",
    )


def _flipped_bits() -> Row:
    flips = flip_bits(FLIPS, seed=1)
    return (
        "one bit flipped, at random",
        f"{flips.refused} of {flips.count} refused, {flips.identical} read identical, 0 wrong; "
        f"{flips.recovered} recovered as a prefix",
    )


def _failing_writes() -> Row:
    failures = fail_every_write()
    return (
        "the k-th write fails, for every k (disk full, input/output error, quota, torn)",
        f"{failures.count} failures, {failures.readable} readable as a prefix, "
        f"{failures.empty} before the first sample; every earlier recording unharmed",
    )


def _power_cuts() -> Row:
    power = cut_the_power(seed=1)
    return (
        "power cut: what was not synced is lost",
        f"{power.moments} moments, never more than {power.longest_loss:.2f} s lost",
    )


def _jumping_clock() -> Row:
    jumps = jump_while_serving(CLOCK_RUNS)
    return (
        f"wall clock that jumps by up to {LARGEST_JUMP / 3600:g} h twice a second",
        f"{jumps.runs} of {jumps.runs} runs and rows as without; runs one after the other say "
        f"that they were made up to {jumps.furthest / 3600:.1f} h apart",
    )


def _stops() -> Row:
    return (
        f"{STOPS} endless runs stopped over REST, one after the other",
        f"95 % have ended and are kept within {stop_runs(STOPS):.2f} s (target 0.5 s)",
    )


def _crowd() -> Row:
    crowd = hold_connections(IDLE, SLOW, CROWD_SECONDS)
    return (
        f"{crowd.idle} idle connections and {crowd.slow} slow senders",
        f"a new client is answered within {crowd.slowest:.2f} s (target 1 s), "
        f"log {crowd.log_bytes / 1e3:.1f} kB (1 MB)",
    )


def _readers() -> Row:
    readers = read_signals(READERS, READ_DURATION, READ_SIGNALS)
    return (
        f"{READERS} clients ask at once for signals of {readers.size / 1e6:.0f} MB",
        ", ".join(f"{n} answered {status}" for status, n in sorted(readers.statuses.items()))
        + f"; memory {readers.peak / 1e6:.0f} MB (1 GB), health "
        f"p95 {1e3 * readers.health_p95:.0f} ms (100 ms)",
    )


def _restart() -> Row:
    restart = restart_with_unfinished(UNFINISHED, UNFINISHED_DURATION)
    return (
        f"SIGKILL with {restart.count} recordings of {restart.size / 1e6:.0f} MB unfinished",
        f"first answer after {restart.waited:.1f} s (target 2 s; {restart.empty:.1f} s with "
        f"an empty folder), all recovered after {restart.seconds:.0f} s; meanwhile answered "
        f"within {restart.slowest:.2f} s",
    )


def _mixed_viewers() -> Row:
    mixed = mix_viewers(POLITE, RUDE, ROUNDS, WATCH_SECONDS, seed=1)
    return (
        f"{RUDE} of {POLITE + RUDE} viewers flood, stall, send garbage or huge messages",
        f"the others keep {100.0 * mixed.share_kept:.0f} % of their updates (target 100 %), and "
        f"{100.0 * mixed.share_of_work:.0f} % of those per second that the server works",
    )


CAMPAIGNS: tuple[Callable[[], Row], ...] = (
    _killed_writers,
    _killed_services,
    _survivors,
    _killed_workers,
    _killed_dask_workers,
    _burst,
    _full_disk,
    _cuts,
    _flipped_bits,
    _failing_writes,
    _power_cuts,
    _jumping_clock,
    _stops,
    _crowd,
    _readers,
    _restart,
    _mixed_viewers,
)
