"""The thread of a service in which all figures are drawn."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

Drawn = TypeVar("Drawn")


def in_drawing_thread(draw: Callable[[], Drawn]) -> Drawn:
    """Executes a function in the drawing thread, and waits for its result.

    matplotlib opens every font again for each drawing thread, and keeps it open long after the
    thread has ended. Programs with many threads should draw here.

    Args:
        draw: Creates and saves figures; its exceptions are raised here.

    Returns:
        The result of the function.
    """
    return _thread().submit(draw).result()


@cache
def _thread() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(1, thread_name_prefix="drawing")
