"""The thread that draws for a service."""

from __future__ import annotations

import io
import os
import sys
import threading
from collections.abc import Callable

import pytest

from slipgrasp.figures.drawing_thread import in_drawing_thread
from slipgrasp.figures.files import save_figure
from slipgrasp.figures.style import add_axes, new_figure, paper_style

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads the list of open files")


def draw() -> None:
    with paper_style():
        figure = new_figure(20.0)
        add_axes(figure, 5.0, 5.0, 20.0, 10.0).set_title("title")
    save_figure(figure, io.BytesIO(), "svg")


def fonts_opened_by(act: Callable[[], object], times: int) -> int:
    """How many more fonts are open after threads that live side by side did something."""
    before, turn = count_fonts(), threading.Barrier(times)

    def do() -> None:
        act()
        turn.wait()  # or the next thread could have the identity of this one

    threads = [threading.Thread(target=do) for _ in range(times)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return count_fonts() - before


def count_fonts() -> int:
    names = []
    for descriptor in os.listdir("/proc/self/fd"):
        try:
            names.append(os.readlink(f"/proc/self/fd/{descriptor}"))
        except FileNotFoundError:
            continue
    return sum(name.endswith(".ttf") for name in names)


def test_many_threads_that_draw_through_it_open_each_font_once():
    in_drawing_thread(draw)
    assert fonts_opened_by(lambda: in_drawing_thread(draw), 5) == 0
    assert fonts_opened_by(draw, 5) >= 5, "matplotlib keeps no font per thread: it is needless"


def test_it_gives_what_was_returned_and_raises_what_was_raised():
    def fail() -> None:
        raise ValueError("no figure")

    assert in_drawing_thread(lambda: threading.current_thread().name).startswith("drawing")
    with pytest.raises(ValueError, match="no figure"):
        in_drawing_thread(fail)
