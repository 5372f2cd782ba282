"""What a session shows: one frozen value that the scene and every panel are drawn from."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.run.result import RunResult
from slipgrasp.web.model.appearance import Appearance
from slipgrasp.web.model.charts import ChartsView
from slipgrasp.web.model.compare import Comparing
from slipgrasp.web.model.draft import Draft
from slipgrasp.web.model.editing import Editing
from slipgrasp.web.model.export import Exporting
from slipgrasp.web.model.page_layout import PageLayout
from slipgrasp.web.model.playback import Playback, WindowChoice
from slipgrasp.web.model.replay import Replay
from slipgrasp.web.model.run_list import RunList
from slipgrasp.web.model.sampling import Sample, Sampler
from slipgrasp.web.model.study import StudyView
from slipgrasp.web.model.words import error_words


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
        errors: What is wrong with which field, if the scenario was refused.
    """

    stage: RunStage
    messages: tuple[str, ...] = ()
    run_id: str = ""
    errors: tuple[FieldError, ...] = ()

    @classmethod
    def refused(cls, error: ScenarioError) -> RunStatus:
        """A scenario that cannot be simulated."""
        messages = tuple(map(error_words, error.errors))
        return cls(RunStage.REFUSED, messages, errors=error.errors)


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

    @property
    def name(self) -> str:
        """What the run is called: as its recording, else by what differs from its preset."""
        return self.replay.name if self.replay else self.result.name


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
        run_list: The list of stored runs.
        comparing: What tells the run on the screen and the pale one apart.
        replay: The recording that was opened last; there is a way back to it.
        notice: What the page has to say across all panels, empty if nothing.
        charts: What the user has made of the charts.
        exporting: The file that is being made for the user.
        editing: How the user edits, and what was asked for before.
        appearance: How the picture looks.
        page_layout: How much room the page has; None until it has told.
        study: The study that is planned, and the one that is followed.
    """

    draft: Draft
    status: RunStatus
    choice: WindowChoice
    ticket: int = 0
    opening: int = 0
    shown: Shown | None = None
    ghost: Ghost | None = None
    playback: Playback | None = None
    run_list: RunList = field(default_factory=RunList)
    comparing: Comparing = field(default_factory=Comparing)
    replay: Replay | None = None
    notice: str = ""
    charts: ChartsView = field(default_factory=ChartsView)
    exporting: Exporting = field(default_factory=Exporting)
    editing: Editing = field(default_factory=Editing)
    appearance: Appearance = field(default_factory=Appearance)
    page_layout: PageLayout | None = None
    study: StudyView = field(default_factory=StudyView)

    @property
    def is_as_recorded(self) -> bool:
        """Whether the recording that was opened last is asked for, with nothing changed."""
        label = self.replay.label if self.replay else None
        return self.draft.origin == label and not self.draft.is_touched

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
