"""Records the scene of the dashboard as data: assignments to its nodes.

The scene is drawn on a stage whose nodes record assignments. If an instant of traced numbers is
drawn, the recorded assignments are formulas: those of the dashboard, for any instant of any run of
the same hand.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from slipgrasp.web.scene.detail import Detail

_CONTACT = re.compile(r"/contact(\d+)(/|$)")


@dataclass(frozen=True, slots=True, eq=False)
class Assignment:
    """Assignment to a property of a node.

    Attributes:
        node: Name of the node.
        key: Name of the property.
        value: Traced numbers, or any other value.
    """

    node: str
    key: str
    value: Any

    @property
    def moves(self) -> bool:
        """True if the value depends on the instant."""
        return isinstance(self.value, np.ndarray) and self.value.dtype == object

    @property
    def contact(self) -> int | None:
        """Contact to which the node belongs, None for other nodes."""
        found = _CONTACT.search(self.node)
        return int(found[1]) if found else None


@dataclass(slots=True)
class Record:
    """Recorded assignments.

    Attributes:
        assignments: Latest assignment of each node and property.
        active: Whether assignments are recorded instead of sent.
    """

    assignments: dict[tuple[str, str], Assignment] = field(default_factory=dict)
    active: bool = False


class _Node:
    """A node of the viewer whose assignments can be recorded."""

    def __init__(self, handle: viser.SceneNodeHandle, record: Record) -> None:
        object.__setattr__(self, "_handle", handle)
        object.__setattr__(self, "_record", record)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._handle, name)

    def __setattr__(self, name: str, value: Any) -> None:
        if self._record.active:
            assignment = Assignment(self._handle.name, name, value)
            self._record.assignments[assignment.node, name] = assignment
        else:
            setattr(self._handle, name, value)


class _RecordingScene:
    """Wraps a scene, so that every added node can be recorded."""

    def __init__(self, scene: viser.SceneApi, record: Record) -> None:
        self._scene, self._record = scene, record

    def __getattr__(self, name: str) -> Any:
        made = getattr(self._scene, name)
        return self._wrapped(made) if name.startswith("add_") else made

    def _wrapped(self, add: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *arguments, **options: _Node(add(*arguments, **options), self._record)


class RecordingStage:
    """A server whose scene can be recorded.

    Args:
        server: The server.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._server, self._record = server, Record()
        self._scene: Any = _RecordingScene(server.scene, self._record)

    @property
    def scene(self) -> viser.SceneApi:
        """The scene with recordable nodes."""
        return self._scene

    def atomic(self) -> AbstractContextManager[None]:
        """A context whose updates arrive at the same time."""
        return self._server.atomic()

    @contextmanager
    def recording(self) -> Iterator[Record]:
        """A context in which assignments are recorded instead of sent."""
        self._record.assignments.clear()
        self._record.active = True
        try:
            yield self._record
        finally:
            self._record.active = False


class EverythingMoves(Detail):
    """Level of detail that redraws all parts at every instant."""

    def is_far(self, now: NDArray[Any], drawn: NDArray[Any]) -> NDArray[np.bool_]:
        """True for all parts."""
        return np.ones(len(now), np.bool_)
