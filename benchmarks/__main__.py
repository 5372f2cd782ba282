"""`python -m benchmarks [PART ...] [--docs DIR] [--seed N]`: measures, prints, updates pages."""

from __future__ import annotations

import argparse
import ast
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

_COST = ("speed", "space", "batch", "scaling", "memory", "front-ends", "recording", "catalogue")
_STUDIES = ("study", "cluster")
_LAWS = ("robustness", "hold-in-space", "claims", "assumptions")
_RANDOM = ("outcomes", "hands-in-space", "soft-grasps", "hints", "fit-coverage", "fit-stick")
_ACCURACY = ("torsion", "onset", "work-precision", "elementary", "reality", "sysid")
_BITS = ("portability", "preset-hashes")
_SERVICE = ("faults", "soak", "long-runs", "dashboard", "replay-seek", "page")
PARTS = (*_COST, *_STUDIES, *_LAWS, *_RANDOM, *_ACCURACY, *_BITS, *_SERVICE)
ONLY_IF_NAMED = ("soak", "reality", "sysid")
_DRAWS = (*ONLY_IF_NAMED, "long-runs")


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
    "seed": Option(int, "N", "draw other random runs", (*_RANDOM, *_DRAWS)),
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
        part = import_module(_module_of(name))
        own = {key: value for key, value in given.items() if name in OPTIONS[key].parts}
        if name == "robustness":
            own["docs"] = options.docs
        found = part.run(**own)
        print(f"\n{name}: {_describe(name)} ({time.perf_counter() - start:.0f} s)\n")
        print("\n\n".join(format_text(table) for table in found), flush=True)
        tables += found
    if options.docs is not None:
        if any(table.page == setting.page for table in tables):
            tables.append(setting)
        for page in dict.fromkeys(table.page for table in tables):
            update_page(options.docs / page, [table for table in tables if table.page == page])
        draw_diagrams(options.docs, [table.name for table in tables])


def _module_of(name: str) -> str:
    return f"benchmarks.{name.replace('-', '_')}"


def _describe(name: str) -> str:
    """First line of the docstring of a part, which is not imported for it."""
    spec = find_spec(_module_of(name))
    assert spec is not None and spec.origin is not None
    text = ast.get_docstring(ast.parse(Path(spec.origin).read_text(encoding="utf-8"))) or ""
    return text.partition("\n")[0].rstrip(".")


def _parser() -> argparse.ArgumentParser:
    listed = "\n".join(f"  {name:16}{_describe(name)}" for name in PARTS)
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
