"""Files that a scenario file refers to; only files in its own folder are read."""

from __future__ import annotations

from pathlib import Path

from slipgrasp.core.exceptions import ScenarioError
from slipgrasp.core.scenario.field_errors import shortened, single_error

ONLY_ON_DISK = "file names are allowed only in a scenario file on the disk of the program"


def read_beside(name: str, folder: Path, field: str, kind: str, most: tuple[int, str]) -> str:
    """Returns the content of a file in the folder of a scenario; symbolic links are followed.

    Args:
        name: Name of the file in the scenario.
        folder: Folder of the scenario; no file outside is read.
        field: Key of the scenario that names the file, for messages.
        kind: Description of the expected file, for messages.
        most: Largest size in bytes, and advice if it is exceeded.

    Raises:
        ScenarioError: If the file does not exist or cannot be read.
    """
    near = "a file in the folder of the scenario"
    try:
        root = folder.resolve()
        path = (root / name).resolve()
        present = path.is_file()
    except (OSError, RuntimeError, ValueError) as error:
        raise file_error(field, name, near, "there is no such file") from error
    if not path.is_relative_to(root):
        raise file_error(field, name, near, "it lies outside the scenario's folder")
    if not present:
        raise file_error(field, name, near, "there is no such file")
    try:
        with path.open("rb") as file:
            content = file.read(most[0] + 1)
    except OSError as error:
        raise file_error(field, name, "a readable file", f"{error.strerror}") from error
    if len(content) > most[0]:
        size = f"{most[0] // 1000} kB"
        raise file_error(field, name, size, f"larger than {size}; {most[1]}")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise file_error(field, name, kind, "not a text file (UTF-8)") from error


def file_error(field: str, name: str, limit: str, problem: str) -> ScenarioError:
    """Returns the error for a file that a scenario names."""
    return single_error(field, name, limit, f"{field} '{shortened(name)}': {problem}")
