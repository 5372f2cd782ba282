"""Custom laws: what each one declares of itself, and which of them this process knows.

Their code is not looked at here (`slipgrasp.core.run.law_code` calls it), so that a scenario with
a law that is not installed can still be read, shown and made again from its recording.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

from slipgrasp.core.scenario.laws import CONTROL_LAWS, ControlLaw

LAW_NAME = r"^[a-z][a-z0-9_-]{0,59}$"
PARAMETER_NAME = r"^[a-z][a-z0-9_]{0,39}$"

INTERFACE_VERSION = 3
"""Of what a law is shown and answers (docs/laws.md)."""

OUTSIDE = "outside"
"""Name of the law of a run whose torques are set tick by tick (`Simulation.ticks`)."""

LAW_PARAMETERS = "controller.parameters"
LAW = "controller.kind"


class Diagnostic(NamedTuple):
    """A number that a law reports at every tick: its name, SI unit and a sentence."""

    name: str
    unit: str
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LawParameter:
    """A parameter of a custom law; its key is ``controller.parameters.NAME``.

    Attributes:
        value: What it is unless the scenario says otherwise.
        minimum: Least allowed value.
        maximum: Largest allowed value.
        text: One sentence for the user.
        unit: SI unit, "1" for pure numbers.
        typical: Range in which a slider moves; the bounds if None.
    """

    value: float
    minimum: float
    maximum: float
    text: str
    unit: str = "1"
    typical: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class LawIdentity:
    """Which law computed a run.

    Attributes:
        name: Value of ``controller.kind``.
        version: As its author counts.
        digest: Of the file that defines it; empty where the torques came from outside.
    """

    name: str
    version: str
    digest: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CustomLaw:
    """A custom law, as it declares itself.

    Attributes:
        identity: Name, version and digest.
        summary: What it does, in a sentence.
        parameters: Its parameters by name.
        diagnostics: The numbers that it reports.
        memory: Shapes of its memory by name.
        estimates: Whether it sets the estimates.
        origin: How it is found: the name of an entry point, or ``FILE.py:Name``; empty for a
            class that was registered as it is.
        source: Text of its file, which workers run; None for an installed package.
        code: The class.
    """

    identity: LawIdentity
    summary: str
    parameters: dict[str, LawParameter] = field(default_factory=dict)
    diagnostics: tuple[Diagnostic, ...] = ()
    memory: dict[str, tuple[int, ...]] = field(default_factory=dict)
    estimates: bool = False
    origin: str = ""
    source: str | None = None
    code: Any = None

    @property
    def name(self) -> str:
        """Value of ``controller.kind``."""
        return self.identity.name

    @property
    def facts(self) -> ControlLaw:
        """What is true of it as of every control law."""
        return _facts(self.name, self.summary)


def _facts(kind: str, summary: str) -> ControlLaw:
    return ControlLaw(kind=kind, summary=summary, sampled=True, uses_friction=False, is_own=True)


_OUTSIDE = CustomLaw(
    identity=LawIdentity(OUTSIDE, "", ""),
    summary="Torques that are set tick by tick by the program that steps the simulation.",
    estimates=True,
)

_known: dict[str, CustomLaw] = {}


def remember(law: CustomLaw) -> None:
    """Makes a law known to this process, in the place of one of the same name."""
    _known[law.name] = law


def forget(name: str) -> None:
    """Makes a law unknown again."""
    _known.pop(name, None)


def custom_law(kind: str) -> CustomLaw | None:
    """The law of that name, if it is custom and known here."""
    return _OUTSIDE if kind == OUTSIDE else _known.get(kind)


def custom_laws() -> tuple[CustomLaw, ...]:
    """The custom laws that are known here."""
    return tuple(_known.values())


def law_names() -> tuple[str, ...]:
    """The laws that a scenario can ask for here, the built-in ones first."""
    return (*CONTROL_LAWS, *_known)


def law_of(kind: str) -> ControlLaw:
    """The facts of a law, whether it is built in, custom or not known here."""
    if kind in CONTROL_LAWS:
        return CONTROL_LAWS[kind]
    own = custom_law(kind)
    return _facts(kind, "A law that is not known here.") if own is None else own.facts


def law_number(kind: str) -> int:
    """The place of a law among the built-in ones, from 0; custom ones come after the last."""
    return list(CONTROL_LAWS).index(kind) if kind in CONTROL_LAWS else len(CONTROL_LAWS)


def law_parameters(kind: str) -> dict[str, LawParameter]:
    """The parameters of a custom law by name; none of others."""
    law = custom_law(kind)
    return {} if law is None else law.parameters
