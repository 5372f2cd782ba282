"""Hashes of the presets' runs on several systems, as one table.

`python .ci/hash_table.py compute FILE.json` computes them here; `… join FILE.json …` prints the
table of all systems, and fails if any hash differs from docs/data/preset-hashes.csv.
"""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Sequence
from pathlib import Path

KNOWN = Path(__file__).parents[1] / "docs" / "data" / "preset-hashes.csv"
_DIGITS = 12


def known_hashes() -> dict[str, str]:
    """The hashes in the documentation, by preset."""
    with KNOWN.open(encoding="utf-8") as file:
        return {row["preset"]: row["SHA-256"] for row in csv.DictReader(file)}


def compute(path: Path) -> None:
    """Writes the hashes of this system."""
    from slipgrasp import load_scenario, simulate

    hashes = {name: simulate(load_scenario(name)).sha256 for name in known_hashes()}
    path.write_text(json.dumps(hashes), encoding="utf-8")


def join(paths: Sequence[Path]) -> bool:
    """Prints the table; returns whether all hashes are those of the documentation."""
    known = known_hashes()
    systems = {path.stem.removeprefix("hashes-"): json.loads(path.read_text()) for path in paths}
    print(f"| preset | known | {' | '.join(systems)} |")
    print("|---" * (2 + len(systems)) + "|")
    for name, value in known.items():
        found = (hashes.get(name, "–") for hashes in systems.values())
        cells = " | ".join("the same" if each == value else each[:_DIGITS] for each in found)
        print(f"| {name} | {value[:_DIGITS]} | {cells} |")
    return bool(systems) and all(hashes == known for hashes in systems.values())


if __name__ == "__main__":
    mode, *names = sys.argv[1:]
    if mode == "compute":
        compute(Path(names[0]))
    elif not join([Path(name) for name in names]):
        sys.exit("some hashes differ")
