"""What recordings survive: kills, cuts, flipped bits, bombs, failing disks, power cuts.

Every campaign is seeded and raises `AssertionError` at the first thing that went wrong;
the tests run a small sample of each.
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.faults.bombs import defuse_all
from benchmarks.faults.clients import hold_connections, read_signals
from benchmarks.faults.damage import cut_everywhere, flip_bits
from benchmarks.faults.disk import cut_the_power, fail_every_write
from benchmarks.faults.full_disk import fill_the_disk
from benchmarks.faults.kills import kill_writers
from benchmarks.faults.services import kill_services, restart_with_unfinished
from benchmarks.faults.viewers import mix_viewers
from benchmarks.faults.workers import kill_in_a_burst, kill_workers
from benchmarks.report import Table

__all__ = ["run"]

KILLS = 100
SERVICE_KILLS = 20
WORKER_KILLS = 100
BURST, BURST_SECONDS = 6, 4.0
UNWRITABLE_RUNS = 7
FLIPS = 2000
IDLE, SLOW, CROWD_SECONDS = 1500, 200, 20.0
UNFINISHED, UNFINISHED_DURATION = 10, 50.0
POLITE, RUDE, ROUNDS, WATCH_SECONDS = 56, 8, 4, 8.0
READERS, READ_DURATION, READ_SIGNALS = 40, 57.0, "t,slip,phase_0"

Rows = tuple[tuple[str, str], ...]


def run(_docs: Path | None = None) -> list[Table]:
    """The tables ``faults`` and ``bombs``."""
    rows = (*_cut_short(), *_damaged(), *_under_load())
    return [Table("faults", ("what happens to a recording", "what is left"), rows), defuse_all()]


def _cut_short() -> Rows:
    """What is left of runs and studies whose processes are killed, or whose disk is full."""
    kills, services = kill_writers(KILLS, seed=1), kill_services(SERVICE_KILLS, seed=1)
    workers = kill_workers(WORKER_KILLS, seed=1)
    burst, full = kill_in_a_burst(BURST, BURST_SECONDS), fill_the_disk(UNWRITABLE_RUNS)
    return (
        (
            "SIGKILL while a run is written, at a random moment",
            f"{kills.count} of {kills.count} still writing, {kills.readable} readable up to the "
            f"last flush ({kills.fewest} to {kills.most} samples)",
        ),
        (
            "SIGKILL of a service that records two runs",
            f"{services.count} of {services.count} restarted, all {services.recovered} runs listed "
            f"as recovered, after {services.slowest:.1f} s at most",
        ),
        (
            "SIGKILL of the workers of a study, again and again",
            f"{workers.count} killed, {workers.runs} of {workers.runs} runs done exactly once: "
            "the same file as undisturbed",
        ),
        (
            f"SIGKILL of {BURST} workers of a study within {BURST_SECONDS:g} s",
            f"{BURST} killed within {burst:.1f} s, the same file as undisturbed",
        ),
        (
            f"{2 * UNWRITABLE_RUNS} runs over REST while the disk is full",
            f"{full.refused} refused with 507 before, of which {full.left} files are left; "
            f"{full.failed} cut off and failed with the reason disk; 0 told as completed",
        ),
    )


def _damaged() -> Rows:
    """What is left of a recording that is cut off, altered or written in part."""
    cuts, flips = cut_everywhere(), flip_bits(FLIPS, seed=1)
    failures, power = fail_every_write(), cut_the_power(seed=1)
    return (
        (
            "cut off after every byte",
            f"{cuts.finished} of a whole file refused; of an unfinished one {cuts.prefixes} read "
            f"as a prefix, {cuts.empty} hold no sample yet and say so",
        ),
        (
            "one bit flipped, at random",
            f"{flips.refused} of {flips.count} refused, {flips.identical} read identical, 0 wrong; "
            f"{flips.recovered} recovered as a prefix",
        ),
        (
            "the k-th write fails, for every k (disk full, input/output error, torn)",
            f"{failures.count} failures, {failures.readable} readable as a prefix, "
            f"{failures.empty} before the first sample; every earlier recording unharmed",
        ),
        (
            "power cut: what was not synced is lost",
            f"{power.moments} moments, never more than {power.longest_loss:.2f} s lost",
        ),
    )


def _under_load() -> Rows:
    """How a service answers while others ask too much, or misbehave."""
    crowd = hold_connections(IDLE, SLOW, CROWD_SECONDS)
    readers = read_signals(READERS, READ_DURATION, READ_SIGNALS)
    restart = restart_with_unfinished(UNFINISHED, UNFINISHED_DURATION)
    mixed = mix_viewers(POLITE, RUDE, ROUNDS, WATCH_SECONDS, seed=1)
    return (
        (
            f"{crowd.idle} idle connections and {crowd.slow} slow senders",
            f"a new client is answered within {crowd.slowest:.2f} s (target 1 s), "
            f"log {crowd.log_bytes / 1e3:.1f} kB (1 MB)",
        ),
        (
            f"{READERS} clients ask at once for signals of {readers.size / 1e6:.0f} MB",
            ", ".join(f"{n} answered {status}" for status, n in sorted(readers.statuses.items()))
            + f"; memory {readers.peak / 1e6:.0f} MB (1 GB), health "
            f"p95 {1e3 * readers.health_p95:.0f} ms (100 ms)",
        ),
        (
            f"SIGKILL with {restart.count} recordings of {restart.size / 1e6:.0f} MB unfinished",
            f"first answer after {restart.waited:.1f} s (target 2 s; {restart.empty:.1f} s with "
            f"an empty folder), all recovered after {restart.seconds:.0f} s; meanwhile answered "
            f"within {restart.slowest:.2f} s",
        ),
        (
            f"{RUDE} of {POLITE + RUDE} viewers flood, stall, send garbage or huge messages",
            f"the others keep {100.0 * mixed.share_kept:.0f} % of their updates (target 100 %)",
        ),
    )
