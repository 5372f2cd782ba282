"""What a session shows: one frozen value that the scene and every panel are drawn from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import cached_property

from core.exceptions import FieldError, ScenarioError
from core.loading import load_scenario, preset_names, with_values
from core.result import RunResult
from core.scenario import Scenario
from web.comparing import Comparing
from web.playback import Playback, WindowChoice
from web.replay import Replay
from web.sampling import Sample, Sampler
from web.shelf import Shelf

__all__ = ["Draft", "Ghost", "RunStage", "RunStatus", "Shown", "ViewState"]

Value = float | int | str | list[float]


@dataclass(frozen=True, slots=True)
class Draft:
    """What the user is asking for: a scenario to start from and the knobs moved since.

    Attributes:
        origin: Name of the preset, or label of the recording.
        base: The scenario of it.
        edits: Values set since, by dotted key; any of them may be out of bounds.
    """

    origin: str
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

    @classmethod
    def from_replay(cls, replay: Replay) -> Draft:
        """The scenario of a recording."""
        return cls(replay.label, replay.result.scenario)

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

    OPENING = "opening"
    REPLAY = "replay"
    UNREADABLE = "unreadable"
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
    """A run on the screen.

    Attributes:
        ticket: Which request it answers; another ticket is another run.
        result: The run.
        elapsed: How long it was computed [s]; 0 if it was read.
        replay: The recording it was read from, None if it was computed.
        sampler: Reads instants off the run.
    """

    ticket: int
    result: RunResult
    elapsed: float
    replay: Replay | None = None
    sampler: Sampler = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "sampler", Sampler(self.result.trace))


@dataclass(frozen=True, slots=True, eq=False)
class Ghost:
    """Another run, drawn pale below the one that is shown.

    Attributes:
        shown: The run.
        label: What it is called: where it comes from.
        is_chosen: Whether the user chose it to compare with; then it stays when knobs move.
    """

    shown: Shown
    label: str
    is_chosen: bool = False


@dataclass(frozen=True, eq=False)
class ViewState:
    """Everything on the screen of one session, at one moment.

    Attributes:
        draft: What the user is asking for.
        status: What became of it.
        choice: Which stretch of a run is shown.
        ticket: The latest request for a run; answers to an older one come too late.
        opening: The latest request for a recording; answers to an older one come too late.
        shown: The run on the screen.
        ghost: The run that is drawn pale below it.
        playback: Where the play head stands.
        shelf: The list of stored runs.
        comparing: What tells the run on the screen and the pale one apart.
        replay: The recording that was opened last; there is a way back to it.
        notice: What the page has to say across all panels, empty if nothing.
    """

    draft: Draft
    status: RunStatus
    choice: WindowChoice
    ticket: int = 0
    opening: int = 0
    shown: Shown | None = None
    ghost: Ghost | None = None
    playback: Playback | None = None
    shelf: Shelf = Shelf()
    comparing: Comparing = Comparing()
    replay: Replay | None = None
    notice: str = ""

    @cached_property
    def sample(self) -> Sample | None:
        """The instant of the run that is shown, at the play head."""
        return self._sample_of(self.shown)

    @cached_property
    def ghost_sample(self) -> Sample | None:
        """The instant of the pale run, at the play head."""
        return self._sample_of(self.ghost.shown if self.ghost else None)

    def _sample_of(self, shown: Shown | None) -> Sample | None:
        if shown is None or self.playback is None:
            return None
        return shown.sampler.at(self.playback.time)
