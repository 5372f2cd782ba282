"""What a session shows: one frozen value that the scene and every panel are drawn from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

from core.exceptions import FieldError, ScenarioError
from core.loading import load_scenario, preset_names, with_values
from core.result import RunResult
from core.scenario import Scenario
from web.playback import Playback, WindowChoice
from web.sampling import Sample

__all__ = ["Draft", "RunStage", "RunStatus", "Shown", "ViewState"]

Value = float | int | str | list[float]


@dataclass(frozen=True, slots=True)
class Draft:
    """What the user is asking for: a preset and the knobs that were moved since.

    Attributes:
        preset: Name of the preset.
        base: The preset itself.
        edits: Values set since, by dotted key; any of them may be out of bounds.
    """

    preset: str
    base: Scenario
    edits: Mapping[str, Value] = field(default_factory=dict)

    @classmethod
    def from_preset(cls, name: str) -> Draft:
        """The preset as it comes.

        Raises:
            ScenarioError: If there is none of that name.
        """
        if name not in preset_names():
            # A name comes from a browser; a path must not be opened for it.
            known = ", ".join(preset_names())
            message = f"there is no preset of that name; presets: {known}"
            raise ScenarioError(
                [FieldError(field="scenario", value=None, limit=known, message=message)]
            )
        return cls(name, load_scenario(name))

    def edited(self, key: str, value: Value) -> Draft:
        """The draft with one more value set."""
        return replace(self, edits={**self.edits, key: value})

    def scenario(self) -> Scenario:
        """The scenario that is asked for.

        Raises:
            ScenarioError: With every value that is not allowed, and its limit.
        """
        return with_values(self.base, self.edits)


class RunStage(StrEnum):
    """How far the latest request has come."""

    COMPILING = "compiling"
    SIMULATING = "simulating"
    PREVIEW = "preview"
    SAVING = "saving"
    SAVED = "saved"
    REFUSED = "refused"
    NOT_SAVED = "not saved"


@dataclass(frozen=True, slots=True)
class RunStatus:
    """What became of the latest request.

    Attributes:
        stage: How far it has come.
        messages: What went wrong, a sentence each; while compiling, how much is done.
        run_id: Where the run is kept, empty unless saved.
    """

    stage: RunStage
    messages: tuple[str, ...] = ()
    run_id: str = ""

    @classmethod
    def refused(cls, error: ScenarioError) -> RunStatus:
        """A scenario that cannot be simulated."""
        return cls(RunStage.REFUSED, tuple(e.message for e in error.errors))


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """The run on the screen.

    Attributes:
        ticket: Which request it answers; another ticket is another run.
        result: The run.
        elapsed: How long it was computed [s].
    """

    ticket: int
    result: RunResult
    elapsed: float


@dataclass(frozen=True, slots=True, eq=False)
class ViewState:
    """Everything on the screen of one session, at one moment."""

    draft: Draft
    status: RunStatus
    choice: WindowChoice
    shown: Shown | None = None
    playback: Playback | None = None
    sample: Sample | None = None
