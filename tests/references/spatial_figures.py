"""Prints what the reference gives for a sample case in space.

python -m tests.references.spatial_figures CASE [SECONDS] [TOLERANCE]
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np

from tests.references.spatial_cases import box, planar, s1, s2, s3
from tests.references.spatial_run import Run, Simulator, World

CASES: dict[str, Callable[[], World]] = {
    "s1": lambda: s1(distribution="softened"),
    "s1h": s1,
    "s1-exact": lambda: s1(distribution="exact"),
    "s1-exact-pyramid": lambda: s1(distribution="exact", friction="pyramid"),
    "s1-pyramid": lambda: s1(friction="pyramid"),
    "s2": s2,
    "s3": lambda: s3(distribution="softened"),
    "s3h": s3,
    "box-thumb": lambda: box("thumb"),
    "box-sides": lambda: box("sides"),
    "box-sides-softened": lambda: box("sides", distribution="softened"),
    "planar-1": lambda: planar(1),
    "planar-1-pyramid": lambda: planar(1, friction="pyramid"),
    "planar-2": lambda: planar(2),
}
KEPT = (0.05, 0.2, 0.5, 2.0, 6.9)


def describe(run: Run, estimates: np.ndarray) -> str:
    """Outcome, ends and paths of slip, slips, errors, estimates, forces and energy."""
    slips = run.slip * 1e3
    lines = [
        f"{run.outcome} at {run.end_time:.6f} s, {run.evaluations} evaluations",
        "slip ends [ms]      " + "  ".join(f"{1e3 * t:.6f}" for t in run.slip_ends),
        "slip path [mm]      " + "  ".join(f"{1e3 * s:.6f}" for s in run.slip_path),
        "s_x, s_y [mm]       " + "; ".join(f"{x:.5f}, {y:.5f}" for x, y in slips),
        "estimates           " + "  ".join(f"{value:.6f}" for value in estimates),
        f"peak F_n {run.peak_force:.4f} N, dissipated {run.dissipated:.6g} J, "
        f"energy missing {run.ledger:.2g} J",
    ]
    for t, e, believed in zip(run.times, run.errors, run.estimates, strict=True):
        errors = "  ".join(f"{1e3 * value:.4f}" for value in e[:6])
        lines.append(f"at {t} s: e [mm, mrad] {errors}; estimates {np.round(believed, 5)}")
    worst = [f"{t:.3f} s {excess:.4f} N" for t, excess in run.violations]
    return "\n".join([*lines, "no grasp inside the cones at " + (", ".join(worst) or "no tick")])


def main() -> None:
    """Runs a case named on the command line."""
    name, *rest = sys.argv[1:]
    duration, tolerance = (*rest, *("0.1", "1e-8")[len(rest) :])
    world = CASES[name]()._replace(tolerance=float(tolerance))
    simulator = Simulator(world, KEPT)
    print(describe(simulator.simulate(float(duration)), simulator.estimates))


if __name__ == "__main__":
    main()
