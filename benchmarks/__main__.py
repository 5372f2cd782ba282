"""`python -m benchmarks`: the paper's cases against MuJoCo, and a slider change on the server."""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import mujoco

from benchmarks.mujoco_scene import build_model
from core.loading import load_scenario, with_values
from core.simulator import prepare_kernel, simulate
from recordings import read_recording, write_recording

REPEATS = 15
PEER_STEP = 1e-3


def median_cpu(work: Callable[[], object], repeats: int = REPEATS) -> float:
    """Median CPU time of a call [s], after one that is not counted."""
    work()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return statistics.median(times)


def step_mujoco(duration: float) -> Callable[[], None]:
    """A run of the same scene in MuJoCo at 1 ms, without any controller in Python."""
    model, data = build_model(load_scenario("paper-case-1"), PEER_STEP)
    return lambda: mujoco.mj_step(model, data, nstep=round(duration / PEER_STEP))


def main() -> None:
    """Prints CPU times and their ratios."""
    prepare_kernel()
    case = load_scenario("paper-case-1")
    peer = median_cpu(step_mujoco(case.simulation.duration), 5)
    print(f"{'7 s of':46}{'CPU [ms]':>10}{'MuJoCo / it':>13}")
    print(f"{'MuJoCo, 1 ms steps, no controller':46}{1e3 * peer:10.1f}{1.0:13.1f}")
    for name in ("paper-case-1", "paper-case-2"):
        for period, words in ((0.0, "continuous control"), (0.001, "1 kHz control")):
            scenario = with_values(load_scenario(name), {"controller.control_period": period})
            seconds = median_cpu(lambda scenario=scenario: simulate(scenario))
            print(f"{f'{name}, {words}':46}{1e3 * seconds:10.1f}{peer / seconds:13.1f}")
    result = simulate(case)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        seconds = median_cpu(lambda: write_recording(result, path, overwrite=True))
        size, rows = path.stat().st_size, len(result.trace)
        print(
            f"\nwriting its recording: {1e3 * seconds:.1f} ms, {1e6 * seconds / rows:.1f} us a row"
        )
        print(f"reading it back:       {1e3 * median_cpu(lambda: read_recording(path)):.1f} ms")
        print(
            f"size:                  {size / 1e3:.0f} kB, {size / 7e3:.0f} kB per simulated second"
        )
    edited = with_values(case, {"object.mass": 1.1})
    change = median_cpu(lambda: simulate(with_values(edited, {"object.mass": 1.2})))
    print(f"\nslider change, validated and simulated: {1e3 * change:.1f} ms")


if __name__ == "__main__":
    main()
