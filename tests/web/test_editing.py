"""Gestures, undo and redo, and what the reducer of the scenario makes of intents."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Change, Pulse
from slipgrasp.core.scenario.loading import (
    load_scenario,
    scenario_to_toml,
    with_values,
)
from slipgrasp.core.scenario.world import SpatialPatch
from slipgrasp.web.model.disturbances import DisturbanceKind
from slipgrasp.web.model.draft import Draft, TimedEdit
from slipgrasp.web.model.editing import History, Reach
from slipgrasp.web.model.intents.compare import EndComparison
from slipgrasp.web.model.intents.scenario import (
    AddDisturbance,
    ChoosePreset,
    ChooseReach,
    LoadScenario,
    Redo,
    RemoveChange,
    RemoveChanges,
    RemoveDisturbance,
    ResetScenario,
    SetParameter,
    Undo,
)
from slipgrasp.web.model.view import RunStage, ViewState
from tests.web.reducing import after, at, view_of

MASS, INERTIA = "object.mass", "object.inertia"


@pytest.fixture
def view(case_2: RunResult) -> ViewState:
    return view_of(case_2)


def rested(view: ViewState) -> ViewState:
    """Some seconds later."""
    gesture = view.editing.gesture
    assert gesture is not None
    gesture = replace(gesture, moved_at=gesture.moved_at - 5.0)
    return replace(view, editing=replace(view.editing, gesture=gesture))


def test_a_control_acts_where_the_play_head_stands(view: ViewState) -> None:
    assert after(view, SetParameter(MASS, 1.4)).draft.changes == (TimedEdit(0.5, MASS, 1.4),)
    assert after(at(view, 0.0), SetParameter(MASS, 1.4)).draft.edits == {MASS: 1.4}


def test_a_control_acts_on_the_whole_run_while_it_plays_and_if_the_user_says_so(
    view: ViewState,
) -> None:
    assert view.playback is not None
    playing = replace(view, playback=replace(view.playback, playing=True))
    for start in (after(view, ChooseReach(Reach.WHOLE_RUN)), playing):
        draft = after(start, SetParameter(MASS, 1.4)).draft
        assert (draft.edits, draft.changes) == ({MASS: 1.4}, ())


def test_a_drag_is_one_change_and_one_step_of_undo_although_the_play_head_moves(
    view: ViewState,
) -> None:
    first = view
    for i in range(10):
        view = after(at(view, 0.5 + 0.01 * i), SetParameter(MASS, 1.0 + 0.1 * i))
    assert view.draft.changes == (TimedEdit(0.5, MASS, 1.9),)
    assert after(view, Undo()).draft == first.draft
    assert after(view, Undo(), Redo()).draft == view.draft


def test_another_control_or_a_rest_begins_another_gesture(view: ViewState) -> None:
    one = after(view, SetParameter(MASS, 1.4))
    two = after(one, SetParameter(INERTIA, 0.02))
    assert after(two, Undo()).draft == one.draft
    again = after(rested(one), SetParameter(MASS, 1.6))
    assert again.draft.changes == (TimedEdit(0.5, MASS, 1.6),)
    assert after(again, Undo()).draft == one.draft
    elsewhere = after(at(rested(one), 0.7), SetParameter(MASS, 1.6))
    assert [change.time for change in elsewhere.draft.changes] == [0.5, 0.7]


def test_everything_that_makes_another_draft_can_be_undone(view: ViewState) -> None:
    changed = after(view, SetParameter(MASS, 1.4))
    for intent in (
        RemoveChange(0.5, MASS),
        RemoveChanges(),
        ResetScenario(),
        ChoosePreset("paper-case-1"),
        LoadScenario("own.toml", scenario_to_toml(load_scenario("paper-case-1")).encode()),
    ):
        then = after(changed, intent)
        assert then.draft != changed.draft
        assert after(then, Undo()).draft == changed.draft
        assert after(then, Undo(), Redo()).draft == then.draft


def test_what_changes_nothing_is_no_step_of_undo(view: ViewState) -> None:
    for intent in (ResetScenario(), RemoveChanges(), RemoveChange(1.0, MASS), Undo(), Redo()):
        assert after(view, intent) is view


def test_something_new_after_undo_forgets_what_was_taken_back(view: ViewState) -> None:
    then = after(view, SetParameter(MASS, 1.4), Undo(), SetParameter(INERTIA, 0.02))
    assert after(then, Redo()) is then


def test_the_oldest_steps_are_forgotten() -> None:
    draft, history = Draft.from_preset("paper-case-1"), History()
    for i in range(500):
        history = history.with_past(draft.edited(MASS, 1.0 + i))
    assert len(history.past) == 200
    assert history.past[-1].edits == {MASS: 500.0}


def test_a_gesture_leaves_a_ghost_until_it_is_dismissed(view: ViewState) -> None:
    moved = after(view, SetParameter(MASS, 1.4))
    assert moved.editing.ghost_due
    dismissed = after(moved, EndComparison())
    assert not after(dismissed, SetParameter(MASS, 1.5)).editing.ghost_due


def test_a_file_is_loaded_with_its_timed_changes(view: ViewState) -> None:
    changes = (Change(time=1.0, parameter=MASS, value=1.2),)
    scenario = replace(load_scenario("paper-case-1"), changes=changes)
    loaded = after(view, LoadScenario("own.toml", scenario_to_toml(scenario).encode()))
    assert loaded.draft.origin == "file own.toml"
    assert loaded.draft.scenario() == scenario
    assert not loaded.draft.is_touched
    elsewhere = after(loaded, SetParameter(MASS, 1.4), ChoosePreset("paper-case-2"))
    assert after(elsewhere, ChoosePreset("file own.toml")).draft == loaded.draft


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "missing"),
        (b"mass = ", "not valid TOML"),
        (b"\xff\xfe", "not valid TOML"),
        (b"a = " + b"[" * 100_000, "not valid TOML"),
        (b"#" * 1_000_001, "larger than 1 MB"),
        (b"[object]\nmass = -1.0\nmas = 2.0\n", "allowed: 0.001"),
    ],
)
def test_a_wrong_file_is_explained_and_the_draft_stays(
    view: ViewState, content: bytes, words: str
) -> None:
    refused = after(view, LoadScenario("own.toml", content))
    assert refused.draft is view.draft
    assert any(words in error.message for error in refused.editing.file_errors)
    good = scenario_to_toml(load_scenario("paper-case-1")).encode()
    assert after(refused, LoadScenario("own.toml", good)).editing.file_errors == ()


def test_a_preset_that_does_not_exist_is_refused(view: ViewState) -> None:
    refused = after(view, ChoosePreset("../../etc/passwd"))
    assert refused.draft is view.draft
    assert refused.status.stage is RunStage.REFUSED


def test_a_push_begins_at_the_play_head_and_can_be_edited_and_taken_back(view: ViewState) -> None:
    pushed = after(view, AddDisturbance(DisturbanceKind.PUSH))
    (pulse,) = pushed.draft.scenario().pulses
    assert pulse == Pulse(time=0.5)
    harder = after(pushed, SetParameter("pulses.0.force.1", -20.0))
    assert harder.draft.scenario().pulses[0].force == (0.0, -20.0)
    assert harder.draft.value_at(0.0, "pulses.0.force.1") == -20.0
    assert after(harder, Undo()).draft == pushed.draft
    assert after(harder, RemoveDisturbance(0)).draft == view.draft
    assert after(harder, RemoveChanges()).draft == view.draft
    assert after(harder, RemoveDisturbance(7)) is harder


def test_a_low_friction_patch_lies_under_the_fingertip_nearest_to_slip_or_under_the_chosen_one(
    view: ViewState, case_2: RunResult
) -> None:
    trace, early = case_2.trace, at(view, 0.05)
    row = int(np.searchsorted(trace.times, 0.05, side="right")) - 1
    nearest = int(trace.friction_margin[row].argmin())
    for contact, expected in ((None, nearest), (0, 0), (1, 1)):
        wet = after(early, AddDisturbance(DisturbanceKind.LOW_FRICTION_PATCH, contact))
        (patch,) = wet.draft.scenario().patches
        assert patch.face == ("left", "right")[expected]
        slip = np.interp(0.05, trace.times, trace.slip[:, expected])
        assert patch.centre == pytest.approx(slip, abs=1e-5)
        assert (patch.start_time, patch.end_time) == (0.05, None)
        assert after(wet, Undo()).draft == view.draft
    assert after(early, AddDisturbance(DisturbanceKind.LOW_FRICTION_PATCH, 5)) is early


def test_a_low_friction_patch_in_space_lies_where_the_chosen_fingertip_is() -> None:
    run = simulate(with_values(load_scenario("spatial-prism"), {"simulation.duration": 0.06}))
    shown = replace(view_of(run), draft=Draft.from_preset("spatial-prism"))
    early, row = at(shown, 0.05), int(np.searchsorted(run.trace.times, 0.05))
    for contact, expected in ((None, int(run.trace.friction_margin[row].argmin())), (1, 1)):
        wet = after(early, AddDisturbance(DisturbanceKind.LOW_FRICTION_PATCH, contact))
        (patch,) = wet.draft.scenario().patches
        assert isinstance(patch, SpatialPatch) and patch.face == f"side-{expected}"
        slip = run.trace.slip[row, 2 * expected : 2 * expected + 2]
        np.testing.assert_allclose(patch.centre, slip, atol=1e-5)
        assert patch.start_time == 0.05


def test_a_run_in_the_plane_tells_nothing_of_faces_in_space(view: ViewState) -> None:
    in_space = replace(view, draft=Draft.from_preset("spatial-prism"))
    assert after(in_space, AddDisturbance(DisturbanceKind.LOW_FRICTION_PATCH)) is in_space


def test_a_pour_is_half_as_much_again_of_mass_and_inertia_in_one_step(view: ViewState) -> None:
    poured = after(view, AddDisturbance(DisturbanceKind.POUR))
    base = view.draft.base.object
    assert [(c.time, c.key, c.value) for c in poured.draft.changes] == [
        (0.5, MASS, 1.5 * base.mass),
        (0.5, INERTIA, pytest.approx(1.5 * base.inertia)),
    ]
    twice = after(at(poured, 1.0), AddDisturbance(DisturbanceKind.POUR))
    assert twice.draft.value_at(1.0, MASS) == pytest.approx(2.25 * base.mass)
    assert after(twice, Undo(), Undo()).draft == view.draft


def test_nothing_can_happen_before_there_is_a_run(view: ViewState) -> None:
    empty = replace(view, shown=None, playback=None)
    assert after(empty, AddDisturbance(DisturbanceKind.PUSH)).draft == empty.draft


def test_pushes_and_low_friction_patches_keep_their_own_numbers(view: ViewState) -> None:
    both = after(
        view,
        AddDisturbance(DisturbanceKind.LOW_FRICTION_PATCH, 0),
        AddDisturbance(DisturbanceKind.PUSH),
        AddDisturbance(DisturbanceKind.LOW_FRICTION_PATCH, 1),
    )
    scenario = both.draft.scenario()
    assert [patch.face for patch in scenario.patches] == ["left", "right"]
    assert len(scenario.pulses) == 1
    dried = after(both, SetParameter("patches.1.end_time", 2.0))
    assert [patch.end_time for patch in dried.draft.scenario().patches] == [None, 2.0]
    left = after(dried, RemoveDisturbance(1)).draft.scenario().patches
    assert [(patch.face, patch.end_time) for patch in left] == [("right", 2.0)]
