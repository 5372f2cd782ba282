"""A question that must be answered before something is done for good."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape

import viser


def ask_to_confirm(
    gui: viser.GuiApi,
    question: str,
    sentences: Sequence[str],
    answer: str,
    do: Callable[[], None],
) -> None:
    """Asks in a window above everything else.

    Args:
        gui: Whose page.
        question: Its title.
        sentences: What it is about, the most important first.
        answer: The word on the button that does it.
        do: Called if the user confirms.
    """
    modal = gui.add_modal(question)
    first, *rest = map(escape, sentences)
    lines = "".join(f"<div style='opacity:0.75;font-size:0.9em'>{line}</div>" for line in rest)

    async def confirm(_: object) -> None:
        if not modal.closed:
            modal.close()
            do()

    async def leave(_: object) -> None:
        if not modal.closed:
            modal.close()

    with modal:
        gui.add_html(f"<div style='padding:0 0.75em 0.75em'><b>{first}</b>{lines}</div>")
        gui.add_button(answer, color="red", hint="Does it; there is no way back.").on_click(confirm)
        keep = gui.add_button("Cancel", color="gray", hint="Closes this window; nothing is done.")
        keep.on_click(leave)
