"""Robustness of recordings: kills, cuts, flipped bits, bombs, failing disks, power cuts.

Every campaign is seeded and raises `AssertionError` at the first fault;
the tests run a small sample of each.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from benchmarks.faults.bombs import defuse_all
from benchmarks.faults.clients import hold_connections, read_signals
from benchmarks.faults.clock import jump_while_serving
from benchmarks.faults.damage import cut_everywhere, flip_bits
from benchmarks.faults.disk import cut_the_power, fail_every_write
from benchmarks.faults.kills import kill_writers
from benchmarks.faults.services import (
    fill_the_disk,
    kill_services,
    restart_with_unfinished,
    stop_runs,
)
from benchmarks.faults.survivors import kill_and_compare
from benchmarks.faults.viewers import mix_viewers
from benchmarks.faults.workers import kill_workers
from benchmarks.report import Table

__all__ = ["run"]


class Campaign(NamedTuple):
    """Something that happens, repeatedly.

    Attributes:
        work: Makes it happen; returns numbers by name.
        happens: Text of the table about it, with names in braces.
        left: Text about the result.
    """

    work: Callable[[], dict[str, Any]]
    happens: str
    left: str


def run() -> list[Table]:
    """The tables ``faults`` and ``bombs``; each row is printed as soon as it is measured."""
    rows = []
    for campaign in CAMPAIGNS:
        found = campaign.work()
        rows.append((campaign.happens.format(**found), campaign.left.format(**found)))
        print(": ".join(rows[-1]), flush=True)
    return [Table("faults", ("what happens", "what is left"), tuple(rows)), defuse_all()]


CAMPAIGNS = (
    Campaign(
        partial(kill_writers, 100, seed=1),
        "SIGKILL while a run is written, at a random moment",
        "{count} of {count} still writing, {readable} readable up to the last flush ({fewest} to "
        "{most} samples)",
    ),
    Campaign(
        partial(kill_services, 20, seed=1),
        "SIGKILL of a service that records two runs",
        "{count} of {count} restarted, all {recovered} runs listed as recovered, after "
        "{slowest:.1f} s at most",
    ),
    Campaign(
        partial(kill_and_compare, 50, 20, seed=1),
        "SIGKILL of a run or a service, {at_random} at a random instant and {in_last_second} in "
        "the last second of a recording",
        "{whole} complete recordings with the bytes of an undisturbed run, {laid_out} of them "
        "finished by recovery; {recovered} recovered as a prefix, {nothing} without a sample yet",
    ),
    Campaign(
        partial(kill_workers, 100, seed=1, runs=20_000),
        "SIGKILL of the workers of a study, again and again",
        "{killed} killed, {runs} of {runs} runs done exactly once: the same file as undisturbed",
    ),
    Campaign(
        partial(kill_workers, 4, seed=1, runs=2000, engine="dask"),
        "SIGKILL of the workers of a Dask cluster",
        "{killed} killed, {runs} of {runs} runs done exactly once: the same file as undisturbed in "
        "processes",
    ),
    Campaign(
        partial(kill_workers, 6, seed=1, runs=2000, every=0.57),
        "SIGKILL of 6 workers of a study within 4 s",
        "{killed} killed within {seconds:.1f} s, the same file as undisturbed",
    ),
    Campaign(
        partial(fill_the_disk, 7),
        "{all} runs over REST while the disk is full",
        "{refused} refused with 507 before, of which {left} files are left; {failed} cut off and "
        "failed with the reason disk; 0 reported as completed",
    ),
    Campaign(
        cut_everywhere,
        "cut off after every byte",
        "{finished} of a whole file refused; of an unfinished one {prefixes} read as a prefix, "
        "{empty} hold no sample yet and say so",
    ),
    Campaign(
        partial(flip_bits, 2000, seed=1),
        "one bit flipped, at random",
        "{refused} of {count} refused, {identical} read identical, 0 wrong; {recovered} recovered "
        "as a prefix",
    ),
    Campaign(
        fail_every_write,
        "the k-th write fails, for every k (disk full, input/output error, quota, torn)",
        "{count} failures, {readable} readable as a prefix, {empty} before the first sample; every "
        "earlier recording unharmed",
    ),
    Campaign(
        partial(cut_the_power, seed=1),
        "power cut: what was not synced is lost",
        "{moments} moments, never more than {loss:.2f} s lost",
    ),
    Campaign(
        partial(jump_while_serving, 50),
        "wall clock that jumps by up to {jump:g} h twice a second",
        "{runs} of {runs} runs and rows as without; runs one after the other say that they were "
        "made up to {furthest:.1f} h apart",
    ),
    Campaign(
        partial(stop_runs, 40),
        "{count} endless runs stopped over REST, one after the other",
        "95 % have ended and are kept within {p95:.2f} s (target 0.5 s)",
    ),
    Campaign(
        partial(hold_connections, idle=1500, slow=200, seconds=20.0),
        "{idle} idle connections and {slow} slow senders",
        "a new client is answered within {slowest:.2f} s (target 1 s), log {log:.1f} kB (1 MB)",
    ),
    Campaign(
        partial(read_signals, 40, duration=57.0, names="t,slip,phase_0"),
        "{clients} clients ask at once for signals of {size:.0f} MB",
        "{statuses}; memory {peak:.0f} MB (1 GB), health p95 {p95:.0f} ms (100 ms)",
    ),
    Campaign(
        partial(restart_with_unfinished, 10, duration=50.0),
        "SIGKILL with {count} recordings of {size:.0f} MB unfinished",
        "first answer after {waited:.1f} s (target 2 s; {empty:.1f} s with an empty folder), all "
        "recovered after {seconds:.0f} s; meanwhile answered within {slowest:.2f} s",
    ),
    Campaign(
        partial(mix_viewers, polite=56, rude=8, rounds=4, seconds=8.0, seed=1),
        "{rude} of {all} viewers flood, stall, send garbage or huge messages",
        "the others keep {kept:.0f} % of their updates (target 100 %), and {of_work:.0f} % of "
        "those per second that the server works",
    ),
)
