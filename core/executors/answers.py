"""Doing what a message asks for, and saying what came of it: the same on every kind of worker."""

from __future__ import annotations

import pickle
import traceback
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any, cast

from slipgrasp.core.executors.executor import Cancelled, ExecutorError, ShouldStop, TaskFunction
from slipgrasp.core.executors.messages import Kind, Message


def ask(round: int, number: int, function: TaskFunction[Any, Any], task: object) -> Message:
    """The message that asks for a task to be done.

    Raises:
        ExecutorError: If no worker would find the function.
    """
    if function.__module__ == "__main__":
        raise ExecutorError(
            f"workers cannot find '{function.__qualname__}', which is defined in the script that "
            "is run; put it into a module that the script imports"
        )
    return Message.pack(Kind.DO, round, number, (function, task))


def do(asked: Message, should_stop: ShouldStop) -> Message:
    """Does the task that was asked for; raises what its function raises."""
    if should_stop():
        raise Cancelled
    function, task = cast("tuple[TaskFunction[Any, Any], Any]", asked.unpack())
    return Message.pack(Kind.RESULT, asked.round, asked.number, function(task, should_stop))


def reply_with(asked: Message, done: Future[Message]) -> Message:
    """What came of it as a message, an error too."""
    error = done.exception()
    if error is None:
        return done.result()
    if isinstance(error, Cancelled):
        return Message(Kind.CANCELLED, asked.round, asked.number)
    return _pack_error(asked, error)


def open_answer(reply: Message) -> object:
    """The result in a message.

    Raises:
        Exception: What the function raised, with a note that says where.
    """
    if reply.kind is Kind.RESULT:
        return reply.unpack()
    if reply.kind is Kind.CANCELLED:
        raise ExecutorError("a task gave up without being asked to")
    kind, arguments, state = cast(
        "tuple[type[BaseException], tuple[Any, ...], dict[str, Any]]", reply.unpack()
    )
    make: Callable[..., BaseException] = kind.__new__
    error = make(kind, *arguments)
    error.__dict__.update(state)
    raise error


def _pack_error(asked: Message, error: BaseException) -> Message:
    """An error in pieces: many cannot be made again from their arguments alone."""
    error.add_note(f"In a worker:\n{''.join(traceback.format_exception(error))}")
    pieces = type(error), error.args, error.__dict__
    try:
        return Message.pack(Kind.ERROR, asked.round, asked.number, pieces)
    except (pickle.PicklingError, TypeError, AttributeError):
        told = f"a task raised {type(error).__name__}: {error}"
        return Message.pack(Kind.ERROR, asked.round, asked.number, (ExecutorError, (told,), {}))
