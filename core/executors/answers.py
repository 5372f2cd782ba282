"""Execution of tasks from messages, and messages with their results, for all kinds of workers."""

from __future__ import annotations

import pickle
import traceback
from collections.abc import Callable
from typing import Any, cast

from slipgrasp.core.executors.executor import Cancelled, ExecutorError, ShouldStop, TaskFunction
from slipgrasp.core.executors.messages import Kind, Message


def ask(round: int, number: int, function: TaskFunction[Any, Any], task: object) -> Message:
    """Returns the message that requests a task.

    Raises:
        ExecutorError: If a worker could not import the function.
    """
    if function.__module__ == "__main__":
        raise ExecutorError(
            f"workers cannot import '{function.__qualname__}', which is defined in the main "
            "script; move it into a module that the script imports"
        )
    return Message.pack(Kind.DO, round, number, (function, task))


def do(asked: Message, should_stop: ShouldStop) -> Message:
    """Executes the requested task; returns the message with its result or exception.

    Raises:
        MemoryError: If the memory is exhausted, so that the state of the process is undefined.
    """
    try:
        if should_stop():
            raise Cancelled
        function, task = cast("tuple[TaskFunction[Any, Any], Any]", asked.unpack())
        return Message.pack(Kind.RESULT, asked.round, asked.number, function(task, should_stop))
    except MemoryError:
        raise
    except Cancelled:
        return Message(Kind.CANCELLED, asked.round, asked.number)
    except BaseException as error:
        return _pack_error(asked, error)


def open_answer(reply: Message) -> object:
    """Returns the result in a message.

    Raises:
        Exception: The exception of the function, with a note of its origin.
    """
    if reply.kind is Kind.RESULT:
        return reply.unpack()
    if reply.kind is Kind.CANCELLED:
        raise ExecutorError("a task stopped without a request")
    kind, arguments, state = cast(
        "tuple[type[BaseException], tuple[Any, ...], dict[str, Any]]", reply.unpack()
    )
    make: Callable[..., BaseException] = kind.__new__
    error = make(kind, *arguments)
    error.__dict__.update(state)
    raise error


def _pack_error(asked: Message, error: BaseException) -> Message:
    """Splits an exception into parts, because many cannot be created from their arguments alone."""
    error.add_note(f"In a worker:\n{''.join(traceback.format_exception(error))}")
    pieces = type(error), error.args, error.__dict__
    try:
        return Message.pack(Kind.ERROR, asked.round, asked.number, pieces)
    except (pickle.PicklingError, TypeError, AttributeError):
        told = f"a task raised {type(error).__name__}: {error}"
        return Message.pack(Kind.ERROR, asked.round, asked.number, (ExecutorError, (told,), {}))
