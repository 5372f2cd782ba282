"""`python -m benchmarks [PART ...] [--docs DIR] [--seed N]`: measures, prints, updates pages."""

from __future__ import annotations

import argparse
import os
import platform
import time
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from benchmarks.charts import draw_diagrams
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
_DRAWN = ["outcomes", "hands-in-space", "soft-grasps", "hints", "long-runs", "soak"]
_SEEDED = [*_DRAWN, "reality", "fit-coverage", "fit-stick", "sysid"]
ONLY_IF_NAMED = ("soak", "reality", "sysid")


class Option(NamedTuple):
    """An option of the command line, which is passed to some parts.

    Attributes:
        kind: Converts its text.
        metavar: Name of its value in the help.
        words: Description.
        parts: The parts that have it.
    """

    kind: Callable[[str], object]
    metavar: str
    words: str
    parts: Sequence[str]


OPTIONS = {
    "seed": Option(int, "N", "draw other random runs", _SEEDED),
    "minutes": Option(float, "N", "duration in minutes (default: 60)", ["soak"]),
    "count": Option(int, "N", "number of soft grasps (default: 5000)", ["soft-grasps"]),
    "cells": Option(Path, "FILE", "store the measurements in this file", ["robustness"]),
    "data": Option(Path, "DIR", "clone of DAIRLab/contact-nets", ["reality"]),
}


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
    given = {name: value for name in OPTIONS if (value := getattr(options, name)) is not None}
    for name in given:
        if not set(names) & set(OPTIONS[name].parts):
            _, metavar, _, parts = OPTIONS[name]
            parser.error(f"--{name} {metavar} is for {', '.join(parts)}")
    prepare_kernel()
    setting, tables = _setting(), []
    print(format_text(setting))
    for name in names:
        start = time.perf_counter()
        part = import_module(f"benchmarks.{name.replace('-', '_')}")
        own = {key: value for key, value in given.items() if name in OPTIONS[key].parts}
        if name == "robustness":
            own["docs"] = options.docs
        found = part.run(**own)
        print(f"\n{name}: {PARTS[name]} ({time.perf_counter() - start:.0f} s)\n")
        print("\n\n".join(format_text(table) for table in found), flush=True)
        tables += found
    if options.docs is not None:
        if any(table.page == setting.page for table in tables):
            tables.append(setting)
        for page in dict.fromkeys(table.page for table in tables):
            update_page(options.docs / page, [table for table in tables if table.page == page])
        draw_diagrams(options.docs, [table.name for table in tables])


def _parser() -> argparse.ArgumentParser:
    listed = "\n".join(f"  {name:16}{words}" for name, words in PARTS.items())
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description=f"Measure speed, cost, memory and accuracy, also of peers.\n\n{listed}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    words = "one of the above; all but soak, reality and sysid if left out"
    parser.add_argument("parts", nargs="*", metavar="PART", help=words)
    for name, option in OPTIONS.items():
        words = f"{option.words} ({', '.join(option.parts)})"
        parser.add_argument(f"--{name}", type=option.kind, metavar=option.metavar, help=words)
    words = "write tables and diagrams into this folder"
    parser.add_argument("--docs", type=Path, metavar="DIR", help=words)
    return parser


def _setting() -> Table:
    packages = ["numba", "numpy", "mujoco", *(["drake"] if find_spec("pydrake") else [])]
    rows = [("processors", str(os.cpu_count())), ("Python", platform.python_version())]
    rows += [(package, version(package)) for package in packages]
    return Table("setting", ("", ""), tuple(rows))


if __name__ == "__main__":
    main()
