"""Records: shared data of the kernel's functions.

A record is one block of memory with named fields, passed by address, which makes calls and
compilation fast. Its arrays have the size of the largest hand; counts state the used part.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from operator import itemgetter
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from slipgrasp.core.scenario import MAX_FINGERS

_CACHE_LINE = 64

Floats: TypeAlias = NDArray[np.float64]
Integers: TypeAlias = NDArray[np.int64]
Layout: TypeAlias = np.dtype[np.void]


class Record(np.void):
    """A record whose fields are attributes, read much faster than those of `numpy.record`."""

    __slots__ = ()

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

        def __setattr__(self, name: str, value: Any) -> None: ...


MAX_COORDINATES = 3 + MAX_FINGERS
MAX_SIDE = max(2 * MAX_FINGERS, MAX_COORDINATES)


def make_record(layout: np.dtype) -> Record:
    """A record of zeros, aligned to cache lines."""
    return _on_cache_lines(np.zeros(layout.itemsize + _CACHE_LINE, np.uint8), layout)


def make_unset_record(layout: np.dtype) -> Record:
    """A record with uninitialised fields."""
    return _on_cache_lines(np.empty(layout.itemsize + _CACHE_LINE, np.uint8), layout)


def as_record(memory: NDArray[Any], layout: np.dtype) -> Record:
    """A record that is a view of existing memory."""
    record: Record = np.frombuffer(memory, _record_dtype(_Same(layout)))[0]
    return record


def _on_cache_lines(memory: NDArray[np.uint8], layout: np.dtype) -> Record:
    start = -memory.ctypes.data % _CACHE_LINE
    return as_record(memory[start : start + layout.itemsize], layout)


class _Same:
    """A layout compared by identity: numpy considers layouts with different alignment equal."""

    __slots__ = ("layout",)

    def __init__(self, layout: Layout) -> None:
        self.layout = layout

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and self.layout is other.layout

    def __hash__(self) -> int:
        return id(self.layout)


@cache
def _record_dtype(same: _Same) -> np.dtype:
    """A layout whose records, including nested ones, are `Record`s."""
    return _make_record_dtype(same.layout)


def _make_record_dtype(layout: np.dtype) -> np.dtype:
    if layout.subdtype is not None:
        element, shape = layout.subdtype
        return np.dtype((_make_record_dtype(element), shape))
    if layout.fields is None:
        return layout
    kinds, offsets = zip(*(field[:2] for field in layout.fields.values()), strict=True)
    same = {
        "names": [*layout.fields],
        "formats": [*map(_make_record_dtype, kinds)],
        "offsets": offsets,
        "itemsize": layout.itemsize,
    }
    fields = {name: property(itemgetter(name), _setter(name)) for name in layout.fields}
    record = type("Record", (Record,), {"__slots__": (), **fields})
    return np.dtype((record, np.dtype(same, align=layout.isalignedstruct)))


def _setter(name: str) -> Callable[[Record, Any], None]:
    def set_field(record: Record, value: Any) -> None:
        record[name] = value

    return set_field
