"""Declarations of custom laws, and the registry of the loaded ones.

Only `slipgrasp.core.run.law_code` calls their code, so that a scenario with a law that is not
installed can still be read, shown and simulated again from its recording.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

from slipgrasp.core.scenario.laws import CONTROL_LAWS, ControlLaw

LAW_NAME = r"^[a-z][a-z0-9_-]{0,59}$"
PARAMETER_NAME = r"^[a-z][a-z0-9_]{0,39}$"

INTERFACE_VERSION = 3
"""Version of the inputs and outputs of a law (docs/laws.md)."""

OUTSIDE = "outside"
"""Name of the law of a run whose torques are set externally (`Simulation.ticks`)."""

LAW_PARAMETERS = "controller.parameters"
LAW = "controller.kind"


class Diagnostic(NamedTuple):
    """A number that a law reports at every tick: name, SI unit and a sentence."""

    name: str
    unit: str
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LawParameter:
    """A parameter of a custom law; its key is ``controller.parameters.NAME``.

    Attributes:
        value: Default value.
        minimum: Smallest allowed value.
        maximum: Largest allowed value.
        text: One sentence for the user.
        unit: SI unit, "1" for pure numbers.
        typical: Range of a slider; the bounds if None.
    """

    value: float
    minimum: float
    maximum: float
    text: str
    unit: str = "1"
    typical: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class LawIdentity:
    """Identity of the law that computed a run.

    Attributes:
        name: Value of ``controller.kind``.
        version: Version that its author gave.
        digest: Digest of the file that defines it; empty if the torques were set externally.
    """

    name: str
    version: str
    digest: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CustomLaw:
    """A custom law with its declarations.

    Attributes:
        identity: Name, version and digest.
        summary: Description in a sentence.
        parameters: Its parameters by name.
        diagnostics: The numbers that it reports.
        memory: Shapes of its memory arrays by name.
        origin: Where to find it: the name of an entry point, or ``FILE.py:Name``; empty for a class
            that was registered directly.
        source: Text of its file, for worker processes; None for an installed package.
        code: The class.
    """

    identity: LawIdentity
    summary: str
    parameters: dict[str, LawParameter] = field(default_factory=dict)
    diagnostics: tuple[Diagnostic, ...] = ()
    memory: dict[str, tuple[int, ...]] = field(default_factory=dict)
    origin: str = ""
    source: str | None = None
    code: Any = None

    @property
    def name(self) -> str:
        """Value of ``controller.kind``."""
        return self.identity.name

    @property
    def facts(self) -> ControlLaw:
        """The facts that every control law has."""
        return _facts(self.name, self.summary)


def _facts(kind: str, summary: str) -> ControlLaw:
    return ControlLaw(kind=kind, summary=summary, sampled=True, uses_friction=False, is_own=True)


_OUTSIDE = CustomLaw(
    identity=LawIdentity(OUTSIDE, "", ""),
    summary="Torques that an external program sets at every tick.",
)

_known: dict[str, CustomLaw] = {}


def remember(law: CustomLaw) -> None:
    """Registers a law in this process; replaces a law of the same name."""
    _known[law.name] = law


def forget(name: str) -> None:
    """Removes a law from the registry."""
    _known.pop(name, None)


def custom_law(kind: str) -> CustomLaw | None:
    """Returns the loaded custom law of this name, if any."""
    return _OUTSIDE if kind == OUTSIDE else _known.get(kind)


def custom_laws() -> tuple[CustomLaw, ...]:
    """The loaded custom laws."""
    return tuple(_known.values())


def law_names() -> tuple[str, ...]:
    """Names of the available laws, the built-in ones first."""
    return (*CONTROL_LAWS, *_known)


def law_of(kind: str) -> ControlLaw:
    """Facts of a law: built-in, custom or not loaded."""
    if kind in CONTROL_LAWS:
        return CONTROL_LAWS[kind]
    own = custom_law(kind)
    return _facts(kind, "A law that is not loaded.") if own is None else own.facts


def law_number(kind: str) -> int:
    """Index of a law among the built-in ones; custom laws follow the last."""
    return list(CONTROL_LAWS).index(kind) if kind in CONTROL_LAWS else len(CONTROL_LAWS)


def law_parameters(kind: str) -> dict[str, LawParameter]:
    """Parameters of a custom law by name; empty for others."""
    law = custom_law(kind)
    return {} if law is None else law.parameters
