"""A study's task of which one run goes too far; module-level, so that workers find it."""

from __future__ import annotations

import ctypes
import os
import signal
import time

import numpy as np

from slipgrasp.recordings.study.task import run_task

FAULTY_RUN = 7


def _run_forever() -> None:
    while True:
        time.sleep(60.0)


def _use_memory() -> None:
    np.ones(100_000_000)


def _break_memory() -> None:
    ctypes.string_at(0)


def _be_killed() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def _do(fault, task, cancelled):
    if task.first <= FAULTY_RUN < task.first + len(task.values):
        fault()
    return run_task(task, cancelled)


def segmentation_fault(task, cancelled):
    return _do(_break_memory, task, cancelled)


def runaway(task, cancelled):
    return _do(_run_forever, task, cancelled)


def too_much_memory(task, cancelled):
    return _do(_use_memory, task, cancelled)


def out_of_memory_kill(task, cancelled):
    return _do(_be_killed, task, cancelled)
