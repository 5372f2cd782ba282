"""Functions that workers do in tests: module-level, so that every engine finds them."""

from __future__ import annotations

import ctypes
import os
import resource
import signal
import threading
import time
from pathlib import Path

import numpy as np

from slipgrasp.core.exceptions import FieldError, ScenarioError
from slipgrasp.core.executors import Cancelled
from slipgrasp.core.run.simulator import simulate
from slipgrasp.recordings.file.state_hash import state_hash


def square(task, should_stop):
    return task * task


def hash_of(scenario, should_stop):
    return state_hash(simulate(scenario))


def wait_until_asked(task, should_stop):
    """Leaves a sign that it has begun, then works on until it is to give up."""
    Path(task).touch()
    while not should_stop():
        time.sleep(0.001)
    raise Cancelled


def end_after_the_others(task, should_stop):
    """The task with a sign leaves it, and gives up only once it is gone; the others at once."""
    _, sign = task
    if sign is not None:
        Path(sign).touch()
    while not should_stop() or (sign is not None and Path(sign).exists()):
        time.sleep(0.001)
    raise Cancelled


def report_until_asked(task, caller):
    """Tells how far it is a thousand times a second."""
    while not caller():
        caller.report(0.5)
        time.sleep(0.001)
    return "asked"


def leave_a_sign_for_ever(task, should_stop):
    Path(task).touch()
    never_listen(task, should_stop)


def never_listen(task, should_stop):
    while True:
        time.sleep(60.0)


def refuse_odd(task, should_stop):
    if task % 2:
        error = FieldError(field="object.mass", value=-1.0, limit="> 0", message=f"{task} is odd")
        raise ScenarioError([error])
    return task


def give_a_lock(task, should_stop):
    return threading.Lock()


def print_and_read(task, should_stop):
    """Prints, and reads what there is: neither may reach the pipes of the engine."""
    print("x" * 100_000)
    os.write(1, b"y" * 100_000)
    return os.read(0, 10)


def die_as_told(task, should_stop):
    """A task is (number, file): with a file it kills its worker once for every letter in it."""
    number, path = task
    if path is not None:
        left = Path(path).read_text()
        if left:
            Path(path).write_text(left[1:])
            os.kill(os.getpid(), signal.SIGKILL)
    return number


def go_too_far(task, should_stop):
    """Does to its process what a task says, and gives back any other task."""
    match task:
        case "segmentation fault":
            ctypes.string_at(0)
        case "memory":
            return float(np.ones(50_000_000).sum())
        case "time":
            never_listen(task, should_stop)
    return task


def give_much(task, should_stop):
    """Says who does it, and gives more than a pipe holds."""
    Path(task).write_text(str(os.getpid()))
    return bytes(5_000_000)


def process_id(task, should_stop):
    return os.getpid()


def thread_setting(task, should_stop):
    return {name: os.environ.get(name) for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}


def wait_for_the_first(task, should_stop):
    """The task with a sign goes on until it is to give up, all others end at once."""
    number, sign = task
    if sign is not None:
        wait_until_asked(sign, should_stop)
    return number


def memory_bounds(task, should_stop):
    score = int(Path("/proc/self/oom_score_adj").read_text())
    return resource.getrlimit(resource.RLIMIT_DATA)[0], score
