"""Loads custom laws: from a file, an installed package, or the source in a task.

Only the user who starts the program chooses the laws; requests cannot load any.
"""

from __future__ import annotations

import hashlib
import inspect
import linecache
import math
import re
import sys
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from types import ModuleType
from typing import Any

from slipgrasp.core.exceptions import SlipgraspError
from slipgrasp.core.scenario.common import MAX_DIAGNOSTICS, MAX_LAW_PARAMETERS
from slipgrasp.core.scenario.custom_laws import (
    LAW_NAME,
    OUTSIDE,
    PARAMETER_NAME,
    CustomLaw,
    Diagnostic,
    LawIdentity,
    LawParameter,
    custom_law,
    remember,
)
from slipgrasp.core.scenario.laws import CONTROL_LAWS, LAW_ALIASES

ENTRY_POINTS = "slipgrasp.laws"

_IN_FILE = re.compile(r"(.+\.py):([A-Za-z_]\w*)")
_LARGEST_MEMORY = 100_000
_TAKEN = ("torque", "estimates")


class LawError(SlipgraspError):
    """A law that does not exist or violates docs/laws.md."""


@dataclass(frozen=True, slots=True)
class LawReference:
    """The reference to a law in a task, which lets a worker load the same law.

    Attributes:
        identity: Required name, version and digest.
        origin: Where to find the law.
        source: Text of its file; None for an installed package.
    """

    identity: LawIdentity
    origin: str
    source: str | None


def load_law(specification: str, folder: Path | None = None) -> CustomLaw:
    """Loads and registers a law.

    Args:
        specification: ``FILE.py:Name``, or the name of an installed law (entry points of the group
            ``slipgrasp.laws``).
        folder: Base folder of relative paths; the current folder if None.

    Raises:
        LawError: If the law does not exist or its declaration is invalid.
    """
    match = _IN_FILE.fullmatch(specification)
    if match is None:
        law = _installed_law(specification)
    else:
        path = (folder or Path()) / match[1]
        try:
            source = path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise LawError(f"the law '{specification[:200]}' cannot be read: {error}") from error
        law = law_from_source(source, f"{path.resolve()}:{match[2]}")
    remember(law)
    return law


def law_from_source(source: str, origin: str) -> CustomLaw:
    """Returns the law in the text of a file.

    Args:
        source: Python source.
        origin: ``FILE.py:Name``; the file need not exist.

    Raises:
        LawError: If the text cannot be executed or has no such class.
    """
    path, _, name = origin.rpartition(":")
    digest = hashlib.sha256(source.encode()).hexdigest()
    module = ModuleType(f"slipgrasp_law_{digest[:16]}")
    module.__file__ = path
    # Error messages then show the line, on other machines too.
    linecache.cache[path] = (len(source), None, source.splitlines(keepends=True), path)
    sys.modules[module.__name__] = module
    try:
        exec(compile(source, path, "exec"), module.__dict__)
    except Exception as error:
        raise LawError(f"'{path}' cannot be run: {type(error).__name__}: {error}") from error
    code = vars(module).get(name)
    if not isinstance(code, type):
        classes = {n: each for n, each in vars(module).items() if isinstance(each, type)}
        laws = [n for n, each in classes.items() if hasattr(each, "command")]
        there = f"; laws in it: {', '.join(laws)}" if laws else ""
        raise LawError(f"'{path}' has no class '{name}'{there}")
    return declared_law(code, digest=digest, origin=origin, source=source)


def admit(reference: LawReference) -> None:
    """Loads and registers the law of a task, if it is the same as where the task was created.

    Raises:
        LawError: If the law is missing or differs.
    """
    wanted = reference.identity
    known = custom_law(wanted.name)
    if known is not None and known.identity == wanted:
        return
    if reference.source is not None:
        law = law_from_source(reference.source, reference.origin)
    elif reference.origin:
        law = _installed_law(reference.origin)
    else:
        raise LawError(
            f"the law '{wanted.name}' was registered in one process only; for use in workers, "
            "define it in a file (FILE.py:Name) or an installed package"
        )
    if law.identity != wanted:
        raise LawError(
            f"a worker rejects the task: its version of the law '{wanted.name}' is "
            f"{law.identity.version}, digest {law.identity.digest[:12]}, but the task needs "
            f"version {wanted.version}, digest {wanted.digest[:12]}; install the same version "
            "everywhere"
        )
    remember(law)


def refer_to(law: CustomLaw) -> LawReference:
    """Returns the reference to a law in a task."""
    return LawReference(law.identity, law.origin, law.source)


def installed_law_names() -> tuple[str, ...]:
    """Names of the laws of installed packages."""
    return tuple(sorted({entry.name for entry in metadata.entry_points(group=ENTRY_POINTS)}))


def _installed_law(name: str) -> CustomLaw:
    entries = [e for e in metadata.entry_points(group=ENTRY_POINTS) if e.name == name]
    if not entries:
        known = ", ".join((*CONTROL_LAWS, *installed_law_names()))
        raise LawError(f"there is no law '{name[:80]}'; laws: {known}; use FILE.py:Name for a file")
    try:
        code = entries[0].load()
    except Exception as error:
        raise LawError(f"the law '{name}' cannot be loaded: {error}") from error
    law = declared_law(code, digest=_digest_of(code), origin=name)
    if law.name != name:
        raise LawError(f"the law installed as '{name}' has the name '{law.name}'")
    return law


def register_law(code: type) -> CustomLaw:
    """Registers a class as a law under its name; for notebooks and tests.

    Args:
        code: A class as docs/laws.md describes it.

    Raises:
        LawError: If the argument is not a class or its declaration is invalid.
    """
    if not isinstance(code, type):
        raise LawError(
            f"the class of a law is needed, not a {type(code).__name__}; laws from load_law are "
            "registered already"
        )
    law = declared_law(code, digest=_digest_of(code))
    remember(law)
    return law


def _digest_of(code: type) -> str:
    """Digest of the file that defines a class; of the class alone if there is no file."""
    try:
        text = Path(inspect.getsourcefile(code) or "").read_bytes()
    except (OSError, TypeError):
        try:
            text = inspect.getsource(code).encode()
        except (OSError, TypeError):
            text = code.__qualname__.encode()
    return hashlib.sha256(text).hexdigest()


def declared_law(
    code: type, *, digest: str, origin: str = "", source: str | None = None
) -> CustomLaw:
    """Returns the law that a class declares.

    Args:
        code: The class.
        digest: Digest of the file that defines it.
        origin: Where to find it.
        source: Text of its file.

    Raises:
        LawError: If a declaration violates docs/laws.md.
    """
    called = re.sub(r"(?<!^)(?=[A-Z])", "-", code.__name__).lower()
    name = str(getattr(code, "name", called))
    if not re.fullmatch(LAW_NAME, name) or name in (*CONTROL_LAWS, *LAW_ALIASES, OUTSIDE):
        raise LawError(
            f"a law cannot have the name '{name[:80]}': it needs a unique name of lower-case "
            "letters, digits and hyphens that no built-in law has"
        )
    if not callable(getattr(code, "command", None)):
        raise LawError(f"the law '{name}' has no method command(seen, memory, out)")
    summary = (inspect.getdoc(code) or "").partition("\n")[0] or "No description."
    return CustomLaw(
        identity=LawIdentity(name, str(getattr(code, "version", "0")), digest),
        summary=summary,
        parameters=_parameters(name, getattr(code, "parameters", {})),
        diagnostics=_diagnostics(name, getattr(code, "diagnostics", {})),
        memory=_memory(name, getattr(code, "memory", {})),
        origin=origin,
        source=source,
        code=code,
    )


def _parameters(law: str, declared: Any) -> dict[str, LawParameter]:
    _check_names(law, "parameters", declared, MAX_LAW_PARAMETERS)
    for name, each in declared.items():
        if not isinstance(each, LawParameter):
            raise LawError(f"the law '{law}': parameters['{name}'] is not a LawParameter")
        if not each.minimum <= each.value <= each.maximum:
            raise LawError(
                f"the law '{law}': its parameter '{name}' is {each.value:g}, outside its bounds "
                f"{each.minimum:g} … {each.maximum:g}"
            )
    return dict(declared)


def _diagnostics(law: str, declared: Any) -> tuple[Diagnostic, ...]:
    _check_names(law, "diagnostics", declared, MAX_DIAGNOSTICS)
    for name, each in declared.items():
        if not (
            isinstance(each, tuple)
            and len(each) == 2
            and all(isinstance(part, str) for part in each)
        ):
            raise LawError(f"the law '{law}': diagnostics['{name}'] must be (unit, sentence)")
        if name in _TAKEN:
            raise LawError(f"the law '{law}': no diagnostic can have the name '{name}'")
    return tuple(Diagnostic(name, unit, text) for name, (unit, text) in declared.items())


def _memory(law: str, declared: Any) -> dict[str, tuple[int, ...]]:
    _check_names(law, "memory", declared, MAX_LAW_PARAMETERS)
    shapes = {n: (s,) if isinstance(s, int) else tuple(s) for n, s in declared.items()}
    if not all(isinstance(k, int) and k > 0 for shape in shapes.values() for k in shape):
        raise LawError(f"the law '{law}': its memory has an invalid shape")
    size = sum(map(math.prod, shapes.values()))
    if size > _LARGEST_MEMORY:
        raise LawError(
            f"the law '{law}': its memory has {size} numbers; allowed: {_LARGEST_MEMORY}"
        )
    return shapes


def _check_names(law: str, what: str, declared: Any, most: int) -> None:
    if not isinstance(declared, dict) or len(declared) > most:
        raise LawError(f"the law '{law}': {what} must be a dict of at most {most} entries")
    for name in declared:
        if not (isinstance(name, str) and re.fullmatch(PARAMETER_NAME, name)):
            raise LawError(
                f"the law '{law}': '{name}' in {what} must be lower-case letters, digits, _"
            )
