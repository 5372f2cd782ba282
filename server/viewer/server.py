"""A viser server that only pages of this machine can use."""

from __future__ import annotations

import asyncio
import logging
import os
import sys
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from functools import cache
from types import ModuleType
from typing import Any, get_type_hints

import numpy as np
import rich
import viser
from viser import _assignable_props_api, _gui_api, _gui_handles, _icons, _scene_api, _viser
from viser.infra import _infra
from viser.infra._async_message_buffer import AsyncMessageBuffer

from slipgrasp.server.exceptions import printable
from slipgrasp.server.http.access import guarded_websocket_listeners

MAX_THREADS = 4
_MAX_LOGGED = 200

_logger = logging.getLogger(__name__)


class ViewerServer(viser.ViserServer):
    """viser on a free loopback port: guarded, silent, and without its public share tunnel."""

    def __init__(self, label: str | None = None) -> None:
        # Its banner shows the internal port on the standard output, which is reserved for our URL.
        rich.get_console().quiet = True
        # viser would prefer the port in this variable to its argument.
        os.environ.pop("_VISER_PORT_OVERRIDE", None)
        _keep_every_icon()
        _keep_every_hint()
        _limit_threads()
        _log_errors_of_callbacks()
        _replace_message_buffers()
        with guarded_websocket_listeners():
            super().__init__(host="127.0.0.1", port=0, label=label, verbose=False)
        self.get_event_loop().set_exception_handler(_log_in_one_line)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Rejects requests of viewers for a tunnel from the internet to this machine."""
        _logger.warning("refused a viewer's request for a public share tunnel")
        return None


class MessageBuffer(AsyncMessageBuffer):
    """A buffer of messages that any thread may send.

    viser sets its event in the thread that sends, and then again in the event loop. The first of
    these changes what the loop is about to change, which ended sessions: "deque mutated".
    """

    def __init__(self, *args: Any, **others: Any) -> None:
        super().__init__(*args, message_event=_LoopEvent(), **others)


class _LoopEvent(asyncio.Event):
    """An event that only its event loop sets; calls in other threads have no effect."""

    def set(self) -> None:
        # No loop runs in other threads.
        with suppress(RuntimeError):
            asyncio.get_running_loop()
            super().set()


def _replace_message_buffers() -> None:
    """Makes viser use `MessageBuffer`."""
    module: ModuleType = sys.modules[_infra.__name__]
    vars(module)["AsyncMessageBuffer"] = MessageBuffer


def _keep_every_icon() -> None:
    """Makes viser read each icon once.

    It caches 32. A page has more, so that each would be looked up in an archive of thousands
    whenever a page is opened, which took three quarters of its processor time.
    """
    for module in (_gui_api, _gui_handles):
        vars(module)["svg_from_icon"] = _svg_of


def _keep_every_hint() -> None:
    """Makes viser evaluate the annotations of each class of elements once.

    It evaluates them for every element, of which a page has hundreds, which took a third of the
    processor time of a new page.
    """
    module: ModuleType = sys.modules[_assignable_props_api.__name__]
    vars(module)["get_type_hints"] = cache(get_type_hints)


def _limit_threads() -> None:
    """Makes viser execute callbacks, which only send messages, in few threads.

    Its 32 threads start one by one over hours, and each retains memory.
    """
    module: ModuleType = sys.modules[_viser.__name__]
    vars(module)["ThreadPoolExecutor"] = _few_threads


def _few_threads(max_workers: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(min(max_workers, MAX_THREADS), thread_name_prefix="viewer")


def _log_errors_of_callbacks() -> None:
    """Makes viser log the errors of callbacks, which it prints."""
    ways = {
        "print_threadpool_errors": _log_error_of_task,
        "print_task_error": _log_error_of_task,
        "print_awaited_callback_error": _log_error_of_callback,
    }
    for module in (_gui_api, _gui_handles, _scene_api, _viser):
        vars(module).update({name: way for name, way in ways.items() if name in vars(module)})


def _log_error_of_task(task: Future[Any] | asyncio.Task[Any]) -> None:
    if not task.cancelled() and (error := task.exception()) is not None:
        _log_error_of_callback(error)


def _log_error_of_callback(error: BaseException) -> None:
    _logger.error("a callback of the viewer failed", exc_info=error)


@cache
def _svg_of(icon: viser.IconName) -> str:
    return _icons.svg_from_icon(icon)


def has_unsent(client: viser.ClientHandle) -> bool:
    """Whether data for a viewer is still waiting to be sent."""
    return bool(client._websock_connection.get_message_buffer().message_from_id)


def release_arrays(node: viser.SceneNodeHandle) -> None:
    """Frees viser's own copy of the arrays of a node; the message to the viewer keeps its arrays.

    viser compares later values with this copy, so that equal ones are then sent again.
    """
    props = node._impl.props
    for name, value in vars(props).items():
        if isinstance(value, np.ndarray):
            setattr(props, name, value[:0].copy())


def _log_in_one_line(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Logs errors of viser's tasks for messages, many of which may be malformed."""
    error = context.get("exception")
    found = context["message"] if error is None else f"{type(error).__name__}: {error}"
    _logger.error(
        "the viewer server failed to process a message: %s", printable(found, _MAX_LOGGED)
    )
