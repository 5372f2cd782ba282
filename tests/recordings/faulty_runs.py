"""A study's task of which one run breaks its worker; module-level, so that workers find it."""

from __future__ import annotations

import ctypes

from slipgrasp.recordings.study.task import run_task

FAULTY_RUN = 7


def segmentation_fault(task, cancelled):
    if task.first <= FAULTY_RUN < task.first + len(task.values):
        ctypes.string_at(0)
    return run_task(task, cancelled)
