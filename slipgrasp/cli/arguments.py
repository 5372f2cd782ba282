"""Arguments that several commands share, and parsers of their values."""

from __future__ import annotations

import argparse
import math
import os
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from slipgrasp.cli.status import CommandError, complain

if TYPE_CHECKING:
    from slipgrasp.core.scenario import Scenario
    from slipgrasp.core.scenario.law_choice import LawChoice
    from slipgrasp.core.scenario.parameters import Parameter
    from slipgrasp.recordings.store.store import RecordingStore

NONE = "none"
Read = TypeVar("Read")


def add_scenario(
    parser: argparse.ArgumentParser, accepted: str = "name of a preset, or a TOML file"
) -> None:
    """Adds ``SCENARIO``, ``--law``, ``--set`` and help with parameters to a parser.

    Args:
        parser: The parser.
        accepted: Help for ``SCENARIO``.
    """
    parser.add_argument("-h", "--help", action=_HelpWithParameters)
    parser.add_argument("scenario", metavar="SCENARIO", help=accepted)
    add_changes(parser)


class _HelpWithParameters(argparse.Action):
    """``--help`` that also lists the parameters, whose definitions it imports only when used."""

    def __init__(self, option_strings: Sequence[str], dest: str) -> None:
        super().__init__(
            option_strings, argparse.SUPPRESS, nargs=0, help="show this help message and exit"
        )

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        """Prints the help and ends the program."""
        from slipgrasp.core.scenario import RAIL, SPATIAL, SUPPORT
        from slipgrasp.core.scenario.field_errors import template_keys

        print(parser.format_help())
        planar = template_keys()
        shown = {_described(key, parameter) for key, parameter in planar.items()}
        print("parameters for --set (indices of lists start at 0):\n")
        _print_parameters(planar)
        for space, what in (
            (SPATIAL, "spatial hands"),
            (SUPPORT, "a body on a support"),
            (RAIL, "a finger on a rail"),
        ):
            print(f"\nparameters of {what} that differ from these:\n")
            own = template_keys(space).items()
            _print_parameters({key: new for key, new in own if _described(key, new) not in shown})
        parser.exit()


def _print_parameters(parameters: Mapping[str, Parameter]) -> None:
    for key, parameter in parameters.items():
        print(_described(key, parameter))


def _described(key: str, parameter: Parameter) -> str:
    return f"  {key}  ({parameter.limit})\n      {parameter.text}"


def add_changes(parser: argparse.ArgumentParser) -> None:
    """Adds ``--law`` and ``--set`` to a parser."""
    parser.add_argument(
        "--law",
        metavar="NAME|FILE.py:Name",
        help="control law of the whole run, with its recommended settings: a built-in law such as "
        "composite ('slipgrasp laws' lists them), an installed law, or a custom law as "
        "FILE.py:Name ('slipgrasp laws new' writes one); --set takes precedence",
    )
    parser.add_argument(
        "--set",
        dest="assignments",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="set a parameter, such as object.mass=1.4 or fingers.*.friction=0.3; may be repeated; "
        "the value 'none' removes an optional parameter",
    )


def read_scenario(arguments: argparse.Namespace) -> Scenario:
    """Reads the scenario from the arguments of `add_scenario`, with its assignments.

    Prints the settings of the law, and its unknowns, on one line of standard error.

    Raises:
        CommandError: If an assignment is malformed.
        ScenarioError: If the scenario does not exist or is not valid.
    """
    from slipgrasp.core.scenario.law_choice import choose_law
    from slipgrasp.core.scenario.loading import load_scenario, settable_parameters
    from slipgrasp.core.study.definition import apply_values

    assignments = arguments.assignments
    # The law is loaded before the file, which may name it.
    law = None if arguments.law is None else know_law(arguments.law)
    base = with_installed_laws(lambda: load_scenario(arguments.scenario))
    choice = None if law is None else choose_law(base, law)
    scenario = base if choice is None else choice.scenario
    if assignments:
        values = parse_assignments(assignments, settable_parameters(scenario))
        scenario = apply_values(scenario, values)
    if choice is not None:
        complain(f"{law}: {_law_words(scenario, choice, base)}")
    return scenario


def know_law(specification: str) -> str:
    """Loads a built-in law, an installed one, or one in a file, and returns its name.

    Raises:
        LawError: If there is no such law.
    """
    from slipgrasp.core.scenario.custom_laws import law_names
    from slipgrasp.core.scenario.law_loading import installed_law_names, load_law
    from slipgrasp.core.scenario.laws import law_kind

    specification = law_kind(specification)
    if specification.endswith(".py"):
        raise CommandError(f"--law {specification}: add the class: {specification}:Name")
    is_elsewhere = ".py:" in specification or specification in installed_law_names()
    if specification in law_names() or not is_elsewhere:
        return specification
    return load_law(specification).name


def with_installed_laws(read: Callable[[], Read]) -> Read:
    """Calls ``read``; if it names an unknown law, loads that from the installed packages."""
    from slipgrasp.core.exceptions import ScenarioError

    try:
        return read()
    except ScenarioError as error:
        kinds = [e.value for e in error.errors if e.field.endswith("controller.kind")]
        if not kinds or know_law(str(kinds[0])) not in _known_laws():
            raise
        return read()


def _known_laws() -> tuple[str, ...]:
    from slipgrasp.core.scenario.custom_laws import law_names

    return law_names()


def _law_words(scenario: Scenario, choice: LawChoice, base: Scenario) -> str:
    """The settings that come with a law, and the unknowns of the resulting scenario.

    Args:
        scenario: The resulting scenario.
        choice: The choice of the law.
        base: The scenario before that choice; if it has the law already, its settings stay.
    """
    from slipgrasp.core.scenario.knowledge import knowledge_of
    from slipgrasp.core.scenario.law_choice import describe_settings
    from slipgrasp.core.words.knowledge_words import given_words, list_unknowns

    known = knowledge_of(scenario)
    told = f", given {given_words(known)} at every instant" if known.told else ""
    is_kept = choice.scenario is base
    unchanged = "its settings in the scenario are kept" if is_kept else "no other setting changes"
    set_with_it = describe_settings(choice.settings) or unchanged
    return f"{set_with_it}; {list_unknowns(known.unknowns)}{told}"


def number_in(
    low: float, high: float, what: str, allowed: str = "", *, of: type[int] | type[float] = float
) -> Callable[[str], Any]:
    """Returns a function that reads a number within limits, for the type of an argument.

    Args:
        low: Smallest allowed number.
        high: Largest allowed number.
        what: What the number is, such as ``a port``.
        allowed: The allowed numbers in words; both limits if empty.
        of: Kind of number.
    """

    def read(text: str) -> Any:
        try:
            number = of(text) if text.isascii() else math.nan
        except ValueError:
            number = math.nan
        if not low <= number <= high:
            limits = allowed or f"allowed: {low:g} … {high:g}"
            raise argparse.ArgumentTypeError(f"'{text[:20]}' is not {what}; {limits}")
        return number

    return read


def add_data_directory(parser: argparse.ArgumentParser) -> None:
    """Adds ``--data-dir``."""
    parser.add_argument(
        "--data-dir",
        dest="data_directory",
        metavar="DIR",
        type=Path,
        help="folder of the recordings (default: SLIPGRASP_DATA, else the platform's data folder)",
    )


def data_directory(chosen: Path | None) -> Path:
    """The folder of the recordings: the chosen one, else that of the environment."""
    from slipgrasp.recordings.store.store import default_data_directory

    return default_data_directory() if chosen is None else chosen


def store_in(chosen: Path | None) -> RecordingStore:
    """The runs in the folder of the recordings."""
    from slipgrasp.recordings.store.store import RecordingStore

    return RecordingStore(data_directory(chosen))


def recording_path(source: str, chosen: Path | None) -> Path:
    """The file of a recording given by its path, or by its id in the data folder.

    Args:
        source: The path or the id.
        chosen: The folder of the recordings, if one was chosen.

    Raises:
        RecordingNotFoundError: If there is no run with this id.
    """
    return Path(source) if names_a_file(source) else store_in(chosen).get(source).path


def names_a_file(source: str) -> bool:
    """Whether a recording is given by its path; anything else is an id."""
    path = Path(source)
    return bool(path.suffix) or path.parent != Path() or path.exists()


def check_output(output: Path, force: bool, option: str = "--output") -> None:
    """Raises an error if a file cannot be written, or exists and must not be replaced.

    Args:
        output: The file.
        force: Whether an existing file is replaced.
        option: Name of the argument on the command line.

    Raises:
        CommandError: If it cannot be written, or exists and must not be replaced.
    """
    if output.is_dir() or not output.parent.is_dir():
        raise CommandError(f"{option} '{output}': give the name of a file in an existing folder")
    if not os.access(output.parent, os.W_OK | os.X_OK):
        raise CommandError(f"{option} '{output}': no permission to write in that folder")
    if output.exists() and not force:
        raise CommandError(f"'{output}' exists; --force replaces it")


def refuse_existing(output: Path | None, force: bool) -> None:
    """Raises an error if a file exists and must not be replaced.

    Args:
        output: The file, if any.
        force: Whether an existing file is replaced.

    Raises:
        RecordingExistsError: If it exists and must not be replaced.
    """
    if output is not None and output.exists() and not force:
        from slipgrasp.recordings.exceptions import RecordingExistsError

        raise RecordingExistsError(output)


def write_new(path: Path, text: str) -> None:
    """Writes a new text file.

    Args:
        path: The file.
        text: Its content.

    Raises:
        CommandError: If it exists or cannot be written.
    """
    try:
        with path.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise CommandError(f"'{path}' exists; choose another name") from None
    except OSError as error:
        raise CommandError(f"'{path}' cannot be written: {error.strerror}") from error


def parse_assignments(texts: Iterable[str], definitions: Mapping[str, Parameter]) -> dict[str, Any]:
    """Reads assignments; the last one of each key counts.

    Args:
        texts: Assignments such as ``object.mass=1.4``; ``*`` stands for every index of a list.
        definitions: The parameters by dotted key; the validation of the scenario does the remaining
            checks.

    Raises:
        CommandError: If an assignment is not of the form KEY=VALUE.
    """
    values = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals or not key.strip():
            raise CommandError(f"--set needs KEY=VALUE, such as object.mass=1.4, not '{text[:80]}'")
        key = key.strip()
        values[key] = parse_value(value.strip(), definitions.get(key.replace(".*", ".0", 1)))
    return values


def parse_value(text: str, parameter: Parameter | None) -> Any:
    """Reads a value as TOML if possible, else as a number, else as text.

    Args:
        text: Text after the equals sign.
        parameter: The assigned parameter, if known; ``none`` removes an optional one.
    """
    if text == NONE and parameter is not None and parameter.optional:
        return None
    if parameter is not None and parameter.kind == "boolean":
        text = text.lower()
    value = _parse_toml(text)
    if parameter is not None and parameter.kind in ("text", "choice"):
        return value if isinstance(value, str) else text
    return value


def _parse_toml(text: str) -> bool | int | float | str | list[Any]:
    try:
        document = tomllib.loads(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return _parse_number(text)
    value = document["value"]
    plain = len(document) == 1 and isinstance(value, (bool, int, float, str, list))
    return value if plain else text


def _parse_number(text: str) -> float | str:
    """Reads numbers in the notation of other programs, such as ``.5``."""
    try:
        return float(text)
    except ValueError:
        return text
