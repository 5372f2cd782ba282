"""Finding a custom law: in a file, among installed packages, or in the source of a task.

Only who starts the program says which laws there are; nothing here is reached by a request.
"""

from __future__ import annotations

import hashlib
import inspect
import linecache
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
    """A law that cannot be found, or does not declare itself as docs/laws.md says."""


@dataclass(frozen=True, slots=True)
class LawReference:
    """A law as a task names it: enough for a worker to have the same one.

    Attributes:
        identity: Name, version and digest that it must have.
        origin: How it is found.
        source: Text of its file; None for an installed package.
    """

    identity: LawIdentity
    origin: str
    source: str | None


def load_law(specification: str, folder: Path | None = None) -> CustomLaw:
    """Makes a law known to this process.

    Args:
        specification: ``FILE.py:Name``, or the name of an installed law (entry points of the group
            ``slipgrasp.laws``).
        folder: What the path of a file starts from; the current folder if None.

    Raises:
        LawError: If there is none, or it does not declare itself properly.
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
    """The law in the text of a file.

    Args:
        source: Python source.
        origin: ``FILE.py:Name``; the file need not be there.

    Raises:
        LawError: If the text cannot be run, or has no such class.
    """
    path, _, name = origin.rpartition(":")
    digest = hashlib.sha256(source.encode()).hexdigest()
    module = ModuleType(f"slipgrasp_law_{digest[:16]}")
    module.__file__ = path
    # So that its errors show their line, on another machine too.
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
    """Makes the law of a task known to this process, if it is the same as where the task was made.

    Raises:
        LawError: If it is not here, or another of that name is.
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
            f"the law '{wanted.name}' was registered in one process only; workers find it in a "
            "file (FILE.py:Name) or an installed package"
        )
    if law.identity != wanted:
        raise LawError(
            f"a worker refuses: its copy of the law '{wanted.name}' is version "
            f"{law.identity.version}, digest {law.identity.digest[:12]}, and version "
            f"{wanted.version}, digest {wanted.digest[:12]} was asked for; install the same on all"
        )
    remember(law)


def refer_to(law: CustomLaw) -> LawReference:
    """The law as a task names it."""
    return LawReference(law.identity, law.origin, law.source)


def installed_law_names() -> tuple[str, ...]:
    """Names of the laws that installed packages offer."""
    return tuple(sorted({entry.name for entry in metadata.entry_points(group=ENTRY_POINTS)}))


def _installed_law(name: str) -> CustomLaw:
    entries = [e for e in metadata.entry_points(group=ENTRY_POINTS) if e.name == name]
    if not entries:
        known = ", ".join((*CONTROL_LAWS, *installed_law_names()))
        raise LawError(
            f"there is no law '{name[:80]}'; laws: {known}; a file is given as FILE.py:Name"
        )
    try:
        code = entries[0].load()
    except Exception as error:
        raise LawError(f"the law '{name}' cannot be loaded: {error}") from error
    law = declared_law(code, digest=_digest_of(code), origin=name)
    if law.name != name:
        raise LawError(f"the law that is installed as '{name}' calls itself '{law.name}'")
    return law


def register_law(code: type) -> CustomLaw:
    """Makes a class known to this process as a law, under its name; for notebooks and tests.

    Args:
        code: A class as docs/laws.md describes it.

    Raises:
        LawError: If it is no class, or does not declare itself properly.
    """
    if not isinstance(code, type):
        raise LawError(
            f"the class of a law belongs here, no {type(code).__name__}; what load_law gives is "
            "registered already"
        )
    law = declared_law(code, digest=_digest_of(code))
    remember(law)
    return law


def _digest_of(code: type) -> str:
    """Digest of the file that defines a class; of the class alone where there is no file."""
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
    """The law that a class declares.

    Args:
        code: The class.
        digest: Of the file that defines it.
        origin: How it is found.
        source: Text of its file.

    Raises:
        LawError: If something that it declares is not as docs/laws.md says.
    """
    called = re.sub(r"(?<!^)(?=[A-Z])", "-", code.__name__).lower()
    name = str(getattr(code, "name", called))
    if not re.fullmatch(LAW_NAME, name) or name in (*CONTROL_LAWS, *LAW_ALIASES, OUTSIDE):
        raise LawError(
            f"a law cannot be called '{name[:80]}': a name of its own is needed, of small letters, "
            "digits and hyphens, that no built-in law has"
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
            raise LawError(f"the law '{law}': parameters['{name}'] is no LawParameter")
        if not each.minimum <= each.value <= each.maximum:
            raise LawError(
                f"the law '{law}': its parameter '{name}' is {each.value:g}, outside its own "
                f"bounds {each.minimum:g} … {each.maximum:g}"
            )
    return dict(declared)


def _diagnostics(law: str, declared: Any) -> tuple[Diagnostic, ...]:
    _check_names(law, "diagnostics", declared, MAX_DIAGNOSTICS)
    for name, each in declared.items():
        if not (isinstance(each, tuple) and len(each) == 2 and all(map(_is_text, each))):
            raise LawError(f"the law '{law}': diagnostics['{name}'] must be (unit, sentence)")
        if name in _TAKEN:
            raise LawError(f"the law '{law}': no diagnostic can be called '{name}'")
    return tuple(Diagnostic(name, unit, text) for name, (unit, text) in declared.items())


def _memory(law: str, declared: Any) -> dict[str, tuple[int, ...]]:
    _check_names(law, "memory", declared, MAX_LAW_PARAMETERS)
    shapes = {n: (s,) if isinstance(s, int) else tuple(s) for n, s in declared.items()}
    if not all(isinstance(k, int) and k > 0 for shape in shapes.values() for k in shape):
        raise LawError(f"the law '{law}': its memory has a shape that is none")
    size = 0
    for shape in shapes.values():
        count = 1
        for k in shape:
            count *= k
        size += count
    if size > _LARGEST_MEMORY:
        raise LawError(f"the law '{law}': its memory has {size} numbers; {_LARGEST_MEMORY} fit")
    return shapes


def _check_names(law: str, what: str, declared: Any, most: int) -> None:
    if not isinstance(declared, dict) or len(declared) > most:
        raise LawError(f"the law '{law}': {what} must be a dict of at most {most} entries")
    for name in declared:
        if not (isinstance(name, str) and re.fullmatch(PARAMETER_NAME, name)):
            raise LawError(f"the law '{law}': '{name}' in {what} must be small letters, digits, _")


def _is_text(value: Any) -> bool:
    return isinstance(value, str)
