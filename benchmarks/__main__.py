"""`python -m benchmarks [PART ...] [--docs DIR] [--seed N]`: measures, prints, updates pages."""

from __future__ import annotations

import argparse
import os
import platform
import time
from collections.abc import Sequence
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from benchmarks.report import Table, format_text, update_page
from slipgrasp.core.run.simulator import prepare_kernel

PARTS = {
    "speed": "single runs against MuJoCo, and the cost of their parts",
    "space": "a spatial hand compared with MuJoCo: cost, cost of its parts, and motion",
    "batch": "many varied runs on two threads against MuJoCo",
    "scaling": "cost over duration and number of fingers",
    "memory": "peak memory of large batches",
    "study": "studies of thousands of runs in processes and over REST",
    "cluster": "cost of a study with every executor, and projected cost on a cluster",
    "robustness": "which control law holds random objects, with its best gains in every world",
    "hold-in-space": "share of 1 000 random objects held by spatial hands with each law",
    "claims": "tests of two claims about the composite law",
    "outcomes": "checks of 20 000 random runs, and of 1 000 against a reference solution",
    "hands-in-space": "checks of runs of 10 000 random spatial hands",
    "soft-grasps": "checks of runs of 5 000 random soft grasps",
    "torsion": "a box that turns between soft fingertips, against MuJoCo and an independent model",
    "hints": "effect of 600 applied hints of random runs",
    "portability": "hashes of runs with other machine code and in WebAssembly",
    "front-ends": "cost per tick of each way to write a law, against MuJoCo with a controller",
    "preset-hashes": "hashes of the presets' runs, which a test computes again",
    "elementary": "error of the kernel's elementary functions and of numpy's against mpmath",
    "assumptions": "effect of choices that the paper leaves open in its two cases",
    "onset": "error of the onset of slip against its closed form",
    "work-precision": "accuracy against cost, compared with MuJoCo and Drake",
    "sampled": "accuracy against cost of sampled control",
    "faults": "recordings under kills, cuts, flipped bits, bombs and failing disks",
    "soak": "a service under mixed load for an hour; only if named",
    "long-runs": "memory of a service with the longest runs, their comparison, and readers",
    "recording": "writing and reading a recording, a slider's change",
    "catalogue": "searching a folder of 10 000 recordings",
    "dashboard": "edits, updates and memory of the dashboard under one and many viewers",
    "reality": "prediction of real slides of a cube; only if named, with --data",
    "fit-coverage": "how often fits of 200 synthetic twins have the true value in their intervals",
    "fit-stick": "how often fits of 200 runs without slip give a bound on friction but no value",
    "page": "live pages: size, first picture, sliders, and a map of 2 500 runs",
    "sysid": "a fit compared with MuJoCo's sysid toolbox; only if named, needs mujoco[sysid]",
    "replay-seek": "scrubbing through a stored minute in the dashboard",
}
SEEDED = (
    "outcomes",
    "hands-in-space",
    "soft-grasps",
    "hints",
    "long-runs",
    "soak",
    "reality",
    "fit-coverage",
    "fit-stick",
    "sysid",
)
ONLY_IF_NAMED = ("soak", "reality", "sysid")


def main(arguments: Sequence[str] | None = None) -> None:
    """Runs the named parts; all of them if none is named.

    Args:
        arguments: Arguments of the command line; those of this process if None.
    """
    parser = _parser()
    options = parser.parse_args(arguments)
    if unknown := set(options.parts) - set(PARTS):
        parser.error(f"no part {', '.join(sorted(unknown))}; parts: {', '.join(PARTS)}")
    names = options.parts or [name for name in PARTS if name not in ONLY_IF_NAMED]
    if options.seed is not None and not set(names) & set(SEEDED):
        parser.error(f"--seed N is for {', '.join(SEEDED)}")
    if options.minutes is not None and "soak" not in names:
        parser.error("--minutes N is for soak")
    if options.count is not None and "soft-grasps" not in names:
        parser.error("--count N is for soft-grasps")
    if (options.data is None) == ("reality" in names):
        parser.error("--data DIR is for reality, which needs it")
    if options.cells is not None and "robustness" not in names:
        parser.error("--cells FILE is for robustness")
    prepare_kernel()
    setting, tables = _setting(), []
    print(format_text(setting))
    for name in names:
        start = time.perf_counter()
        part = import_module(f"benchmarks.{name.replace('-', '_')}")
        found = part.run(options.docs, **_options_of(name, options))
        print(f"\n{name}: {PARTS[name]} ({time.perf_counter() - start:.0f} s)\n")
        print("\n\n".join(format_text(table) for table in found), flush=True)
        tables += found
    if options.docs is not None:
        if any(table.page == setting.page for table in tables):
            tables.append(setting)
        for page in dict.fromkeys(table.page for table in tables):
            update_page(options.docs / page, [table for table in tables if table.page == page])


def _options_of(name: str, options: argparse.Namespace) -> dict[str, Any]:
    """The command-line arguments that a part receives in addition to its output."""
    seed = {"seed": options.seed} if name in SEEDED and options.seed is not None else {}
    minutes = {"minutes": options.minutes} if name == "soak" and options.minutes else {}
    count = {"count": options.count} if name == "soft-grasps" and options.count else {}
    cells = {"cells": options.cells} if name == "robustness" else {}
    data = {"data": options.data} if name == "reality" else {}
    return seed | minutes | count | cells | data


def _parser() -> argparse.ArgumentParser:
    listed = "\n".join(f"  {name:16}{words}" for name, words in PARTS.items())
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description=f"Speed, cost, memory, accuracy and truth, beside a peer.\n\n{listed}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "parts",
        nargs="*",
        metavar="PART",
        help="one of the above; all but soak, reality and sysid if left out",
    )
    parser.add_argument(
        "--docs", type=Path, metavar="DIR", help="write tables and diagrams into this folder"
    )
    parser.add_argument(
        "--seed", type=int, metavar="N", help=f"draw other random runs ({', '.join(SEEDED)})"
    )
    parser.add_argument(
        "--minutes", type=float, metavar="N", help="how long soak lasts (default: 60)"
    )
    parser.add_argument(
        "--count", type=int, metavar="N", help="how many soft grasps are drawn (default: 5000)"
    )
    parser.add_argument(
        "--cells", type=Path, metavar="FILE", help="keep what robustness measures in this file"
    )
    parser.add_argument("--data", type=Path, metavar="DIR", help="clone of DAIRLab/contact-nets")
    return parser


def _setting() -> Table:
    packages = ["numba", "numpy", "mujoco", *(["drake"] if find_spec("pydrake") else [])]
    rows = [("processors", str(os.cpu_count())), ("Python", platform.python_version())]
    rows += [(package, version(package)) for package in packages]
    return Table("setting", ("", ""), tuple(rows))


if __name__ == "__main__":
    main()
