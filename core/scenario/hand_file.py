"""The fingers of a hand from a TOML file beside the scenario file (``slipgrasp hands import``)."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from slipgrasp.core.scenario.beside import ONLY_ON_DISK, file_error, read_beside

_FIELD, _KIND = "hand", "a hand file"
_MOST = 200_000, "a hand has at most a few fingers"


def fill_in_hand(mapping: dict[str, Any], folder: Path) -> None:
    """Builds the fingers of a scenario as the file says that ``hand`` names, if it names one.

    Args:
        mapping: A scenario as plain values, changed in place: what the file says of a finger
            replaces what the scenario says.
        folder: Where its file lies; nothing outside of it is read.

    Raises:
        ScenarioError: If the file is not there, or does not fit.
    """
    name = mapping.get(_FIELD)
    if isinstance(name, str):
        built = _tables(_parse(read_beside(name, folder, _FIELD, _KIND, _MOST), name))
        given = _tables(mapping)
        if built is None:
            raise file_error(_FIELD, name, _KIND, "it has no [[fingers]] with what they consist of")
        if given is None or len(given) != len(built):
            count = len(given or ())
            wanted = f"{len(built)} [[fingers]]"
            problem = f"it has {len(built)} fingers, the scenario {count}; give each its face"
            raise file_error(_FIELD, name, wanted, problem)
        mapping["fingers"] = [a | b for a, b in zip(given, built, strict=True)]
        del mapping[_FIELD]


def refuse_hand_name(mapping: Any) -> None:
    """Raises if ``hand`` is still a name: where there is no folder, none is looked up.

    Raises:
        ScenarioError: If it is.
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
