"""Whatever is asked of a session, in whatever order: it answers the next question."""

from __future__ import annotations

import random
from collections.abc import Callable

import pytest

from benchmarks.headless_viewer import HeadlessViewer
from slipgrasp.core.run.result import RunResult
from slipgrasp.core.scenario.loading import load_scenario
from slipgrasp.core.scenario.own_laws import law_names
from slipgrasp.core.scenario.parameters import describe
from slipgrasp.web.model.disturbances import DisturbanceKind
from slipgrasp.web.model.editing import Reach
from slipgrasp.web.model.intents.compare import CompareRuns, EndComparison, SwapRuns
from slipgrasp.web.model.intents.heavier import AskHowHeavy
from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.picture import (
    DrawAgainst,
    FrameHand,
    SeeCharts,
    ToggleDark,
    ToggleLecture,
    ToggleLine,
    ToggleMark,
    ToggleSignal,
)
from slipgrasp.web.model.intents.playback import (
    GoToEdge,
    JumpToEvent,
    Seek,
    Step,
    TogglePlay,
    Zoom,
)
from slipgrasp.web.model.intents.premises import FindPremises
from slipgrasp.web.model.intents.recordings import OpenRecording
from slipgrasp.web.model.intents.scenario import (
    AddDisturbance,
    ChooseLaw,
    ChoosePreset,
    ChooseReach,
    DragObject,
    LetGo,
    Redo,
    RemoveChanges,
    RemoveDisturbance,
    ResetScenario,
    SetParameter,
    Undo,
)
from slipgrasp.web.model.intents.tour import ToggleTour, VisitStop
from tests.server.serving import RunningServer

ROUNDS, INTENTS = 8, 10
UNHEARD_OF = SetParameter("object.mass", 1.234)
TABS = ("Contact", "Motion", "Beliefs", "Energy", "Signals", "XY", "Laws")
PLAIN: tuple[type[Intent], ...] = (
    *(AskHowHeavy, EndComparison, FindPremises, FrameHand, Redo, RemoveChanges, ResetScenario),
    *(SwapRuns, ToggleDark, ToggleLecture, ToggleMark, TogglePlay, ToggleTour, Undo, Zoom),
)


def drawn_at_random(rng: random.Random, preset: str, runs: list[str]) -> Intent:
    """What a user of a preset may ask for, or a script that is wrong."""
    base = load_scenario(preset)
    force = tuple(rng.uniform(-5.0, 5.0) for _ in range(3 if base.in_space else 2))
    signals = ("", "t", "slip_0", "normal_force_1", "object_pose_x", "nothing")
    kinds: list[Callable[[], Intent]] = [
        rng.choice(PLAIN),
        *[lambda: AddDisturbance(rng.choice(list(DisturbanceKind)), rng.choice((None, 0, 7)))] * 3,
        lambda: ChooseLaw(rng.choice(law_names())),
        lambda: ChooseReach(rng.choice(list(Reach))),
        lambda: CompareRuns(*rng.choices(runs, k=2)),
        lambda: DragObject(force),
        lambda: DrawAgainst(rng.choice(signals)),
        lambda: GoToEdge(rng.choice((-1, 1))),
        lambda: JumpToEvent(rng.choice((-1, 1))),
        lambda: LetGo(force),
        lambda: OpenRecording(rng.choice(runs)),
        lambda: RemoveDisturbance(rng.randrange(3)),
        lambda: SeeCharts(rng.choice(TABS), True),
        lambda: Seek(rng.uniform(-1.0, 8.0)),
        *[lambda: _set(rng, preset)] * 4,
        lambda: Step(rng.choice((-1, 1))),
        lambda: ToggleLine("slip", "slip-0"),
        lambda: ToggleSignal(rng.choice(signals)),
        lambda: VisitStop(rng.randrange(30)),
    ]
    return rng.choice(kinds)()


def _set(rng: random.Random, preset: str) -> SetParameter:
    """A number may be anything; what is no number has no such knob."""
    numbers = {k: p.value for k, p in describe(load_scenario(preset)).items() if p.kind == "number"}
    key = rng.choice([key for key, value in numbers.items() if isinstance(value, float)])
    return SetParameter(key, rng.choice((0.0, 0.5, 0.9, 1.1, 2.0, -1.0, 1e6)) * numbers[key])


@pytest.mark.slow
@pytest.mark.parametrize("preset", ["paper-case-2", "spatial-prism"])
def test_a_session_lives_on_whatever_is_asked_of_it(
    dashboard: RunningServer, preset: str, case_1: RunResult, sluggish: RunResult
) -> None:
    rng, served = random.Random(preset), dashboard.app.state.dashboard
    store = dashboard.app.state.run_service.store
    runs = ["unknown", *(store.save(run).id for run in (case_1, sluggish))]
    with HeadlessViewer(f"ws://127.0.0.1:{dashboard.port}/") as viewer:
        send = served.directory.find(viewer.key())
        assert send is not None
        for _ in range(ROUNDS):
            send(ChoosePreset(preset))
            viewer.read_for(0.4)
            for _ in range(INTENTS):
                send(drawn_at_random(rng, preset, runs))
                viewer.read_for(0.03)
        for last in (ChoosePreset("paper-case-1"), ChooseReach(Reach.WHOLE_RUN), UNHEARD_OF):
            send(last)
        viewer.wait_for(lambda message: "mass 1.234 kg" in str(message))
