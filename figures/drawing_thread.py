"""The one thread that draws for a service."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

Drawn = TypeVar("Drawn")


def in_drawing_thread(draw: Callable[[], Drawn]) -> Drawn:
    """Has the thread that draws do something, and waits until it is done.

    matplotlib opens every font anew for each thread that draws, and keeps it open long after
    the thread has ended. A program that draws in many threads does it here.

    Args:
        draw: Makes figures and saves them; what it raises is raised here.

    Returns:
        What it returns.
    """
    return _thread().submit(draw).result()


@cache
def _thread() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(1, thread_name_prefix="drawing")
