"""The hashes of the presets' runs, as in docs/portability.md."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from benchmarks.portable_runs import preset_hashes
from benchmarks.report import PORTABILITY, Table, read_table
from slipgrasp.core.scenario import RAIL, SUPPORT
from slipgrasp.core.scenario.loading import preset_names
from slipgrasp.core.scenario.space import PLANAR

NAME = "preset-hashes"


def run() -> list[Table]:
    """The table ``preset-hashes``."""
    return [tabulate_presets(preset_hashes(PLANAR))]


def tabulate_presets(hashes: Mapping[str, str]) -> Table:
    """The complete hashes of the presets, from all hashes; those without a hand are added."""
    rows = {name: hashes[name] for name in preset_names()} | preset_hashes(SUPPORT, RAIL)
    return Table(NAME, ("preset", "SHA-256"), tuple(rows.items()), (), PORTABILITY)


def read_presets(page: Path) -> dict[str, str]:
    """The hashes in docs/portability.md."""
    return dict(read_table(page, NAME)[1:])
