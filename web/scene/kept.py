"""Nodes that stay in the scene until something on which they depend changes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, Protocol, TypeVar


class Removable(Protocol):
    """Nodes of a scene."""

    def remove(self) -> None:
        """Removes them."""
        ...


Nodes = TypeVar("Nodes", bound=Removable)


class Kept(Generic[Nodes]):
    """Nodes with a key; other nodes take their place when the key changes.

    Attributes:
        nodes: The present nodes, if any.
    """

    def __init__(self) -> None:
        self.nodes: Nodes | None = None
        self._key: object = None

    def fits(self, key: object) -> bool:
        """Whether there are nodes, and they have a key."""
        return self.nodes is not None and self._key == key

    def renew(self, key: object, make: Callable[[], Nodes]) -> Nodes:
        """The nodes with a key, which are made unless they are the present ones."""
        if self.nodes is None or self._key != key:
            self.remove()
            self.nodes, self._key = make(), key
        return self.nodes

    def remove(self) -> None:
        """Removes the present nodes."""
        if self.nodes is not None:
            self.nodes.remove()
        self.nodes = None
