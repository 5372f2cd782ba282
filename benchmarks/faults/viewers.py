"""Many viewers of whom some misbehave: what is left of the frame rate of the others."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from benchmarks.dashboard import Served, serve_dashboard
from benchmarks.dashboard_viewers import Watched, come_and_go, view
from benchmarks.processes import processor_time_of

SETTLE_EACH, SETTLE = 0.5, 10.0


@dataclass(frozen=True, slots=True)
class MixedViewers:
    """What well-mannered viewers saw alone, and beside those who are not.

    Attributes:
        alone: Updates per second, the mean over all viewers, round by round.
        beside: The same while the others misbehaved.
        alone_work: What the server worked in each of the former [s].
        beside_work: And in each of the latter [s].
        sent_away: How often the others were, by what they did and the code of the closing.
    """

    alone: list[float] = field(default_factory=list)
    beside: list[float] = field(default_factory=list)
    alone_work: list[float] = field(default_factory=list)
    beside_work: list[float] = field(default_factory=list)
    sent_away: Counter[str] = field(default_factory=Counter)

    @property
    def share_kept(self) -> float:
        """Of the frame rate: of all updates beside the others to all alone."""
        return float(np.sum(self.beside) / np.sum(self.alone))

    @property
    def share_of_work(self) -> float:
        """How much of the server's work is left for them, whatever else the machine does."""
        alone = np.sum(self.alone) / np.sum(self.alone_work)
        return float(np.sum(self.beside) / np.sum(self.beside_work) / alone)


def mix_viewers(polite: int, rude: int, rounds: int, seconds: float, seed: int) -> MixedViewers:
    """Lets viewers watch a run play, alone and beside others who misbehave, in turns.

    Args:
        polite: How many watch.
        rude: How many misbehave, again and again, in a process of their own.
        rounds: How often in turns.
        seconds: How long each turn is.
        seed: Of what is random about the misbehaviour.

    Raises:
        AssertionError: If a well-mannered viewer is sent away, or another one is not.
    """
    with serve_dashboard() as served:
        come_and_go(served.socket, 1)
        return asyncio.run(_mix(served, polite, rude, rounds, seconds, seed))


async def _mix(
    served: Served, polite: int, rude: int, rounds: int, seconds: float, seed: int
) -> MixedViewers:
    found, seen = MixedViewers(), [Watched() for _ in range(polite)]
    viewers = [asyncio.create_task(view(served.socket, one)) for one in seen]
    command = [sys.executable, "-m", "benchmarks.faults.rude_viewers", served.socket, str(rude)]
    await asyncio.sleep(SETTLE_EACH * polite)
    for number in range(rounds):
        await _watch(served, seen, seconds, found.alone, found.alone_work)
        others = await asyncio.create_subprocess_exec(
            *command, f"{seed} {number}", stdin=subprocess.PIPE, stdout=subprocess.PIPE
        )
        assert others.stdout is not None
        await others.stdout.readline()  # They come now, each with a session to begin.
        await asyncio.sleep(SETTLE)
        await _watch(served, seen, seconds, found.beside, found.beside_work)
        told, _ = await others.communicate(b"")
        assert others.returncode == 0, "somebody was not sent away as expected"
        found.sent_away.update(json.loads(told))
    gone = sum(viewer.done() for viewer in viewers)
    for viewer in viewers:
        viewer.cancel()
        with suppress(asyncio.CancelledError):
            await viewer
    assert not gone, f"{gone} of {polite} well-mannered viewers were sent away"
    return found


async def _watch(
    served: Served,
    seen: Sequence[Watched],
    seconds: float,
    rates: list[float],
    works: list[float],
) -> None:
    """Notes updates per second, the mean over all viewers, and what the server worked."""
    for one in seen:
        one.forget()
    began = processor_time_of(served.process)
    await asyncio.sleep(seconds)
    works.append(processor_time_of(served.process) - began)
    rates.append(float(np.mean([len(one.arrivals) for one in seen])) / seconds)
