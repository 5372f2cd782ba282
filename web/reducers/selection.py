"""The reducer of the selection."""

from __future__ import annotations

from dataclasses import replace

from slipgrasp.web.model.intents.intent import Intent
from slipgrasp.web.model.intents.scenario import AddDisturbance, ChooseLaw, LetGo
from slipgrasp.web.model.intents.selection import FindParameters, Select, ToggleAllParameters
from slipgrasp.web.model.selection import LAW_PART, OBJECT, PUSH, Selection, parts_of
from slipgrasp.web.model.view import ViewState
from slipgrasp.web.reducers.reducer import Reducer


class SelectionReducer(Reducer):
    """Selects parts; after the reducer of the scenario, which adds pushes and patches."""

    def __init__(self) -> None:
        self._known: tuple[str, ...] = ()

    def reduce(self, intent: Intent, view: ViewState) -> ViewState:
        """Changes the selection; a part that the scenario lacks changes nothing."""
        selection = self._changed(intent, view)
        return view if selection == view.selection else replace(view, selection=selection)

    def pass_time(self, now: float, view: ViewState) -> ViewState:
        """Selects the object once the selected part is gone."""
        self._known = tuple(part for part, _ in parts_of(view.draft))
        if view.selection.part in self._known:
            return view
        return replace(view, selection=replace(view.selection, part=OBJECT))

    def _changed(self, intent: Intent, view: ViewState) -> Selection:
        selection, parts = view.selection, [part for part, _ in parts_of(view.draft)]
        match intent:
            case Select(part) if part in parts:
                return Selection(part)
            case FindParameters(search):
                return replace(selection, search=search.strip())
            case ToggleAllParameters():
                return replace(selection, all=not selection.all)
            case ChooseLaw():
                return Selection(LAW_PART)
            case LetGo(force):
                pushes = [part for part in parts if part.startswith(PUSH)]
                return Selection(pushes[-1] if pushes and any(force) else OBJECT)
            case AddDisturbance():
                added = [part for part in parts if part not in self._known]
                return Selection(added[-1]) if added else selection
            case _:
                return selection
