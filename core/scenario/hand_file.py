"""Fingers from a TOML file in the folder of the scenario file (``slipgrasp hands import``)."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from slipgrasp.core.scenario.beside import ONLY_ON_DISK, file_error, read_beside

_FIELD, _KIND = "hand", "a hand file"
_MOST = 200_000, "a hand has at most a few fingers"


def fill_in_hand(mapping: dict[str, Any], folder: Path) -> None:
    """Adds the finger parameters in the file named by ``hand``, if any, to a scenario.

    Args:
        mapping: A scenario as plain values, changed in place; the file overrides its values.
        folder: Folder of the scenario file; no file outside is read.

    Raises:
        ScenarioError: If the file does not exist or does not fit.
    """
    name = mapping.get(_FIELD)
    if isinstance(name, str):
        built = _tables(_parse(read_beside(name, folder, _FIELD, _KIND, _MOST), name))
        given = _tables(mapping)
        if built is None:
            raise file_error(_FIELD, name, _KIND, "it has no complete [[fingers]]")
        if given is None or len(given) != len(built):
            count = len(given or ())
            wanted = f"{len(built)} [[fingers]]"
            problem = f"it has {len(built)} fingers, but the scenario has {count}; give each a face"
            raise file_error(_FIELD, name, wanted, problem)
        mapping["fingers"] = [a | b for a, b in zip(given, built, strict=True)]
        del mapping[_FIELD]


def refuse_hand_name(mapping: Any) -> None:
    """Raises an error if ``hand`` is a file name, which is allowed only in files.

    Raises:
        ScenarioError: If it is a file name.
    """
    name = mapping.get(_FIELD) if isinstance(mapping, dict) else None
    if isinstance(name, str):
        raise file_error(_FIELD, name, "fingers", f"{ONLY_ON_DISK}; give the fingers themselves")


def _parse(text: str, name: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise file_error(_FIELD, name, "TOML", f"it is not valid TOML: {error}") from error


def _tables(mapping: dict[str, Any]) -> list[dict[str, Any]] | None:
    fingers = mapping.get("fingers")
    is_list = isinstance(fingers, list) and all(isinstance(each, dict) for each in fingers)
    return fingers if is_list else None
