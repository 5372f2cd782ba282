"""Outputs and calls of custom laws.

Their machine code is not part of the kernel. It is called through its address; if the address is
0, the run pauses until the command is set (`slipgrasp.core.run.simulation.Simulation.ticks`). The
inputs differ between planar and spatial hands.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from slipgrasp.core.kernel.compilation.compiler import INTERPRETED, address_of, compiled
from slipgrasp.core.kernel.compilation.records import MAX_FINGERS, Layout, Record
from slipgrasp.core.scenario import MAX_DIAGNOSTICS, MAX_UNKNOWNS

NOTHING, ASKED, ANSWERED = range(3)


def answer_layout(num_joints: int) -> Layout:
    """Outputs of the law."""
    fields = [
        ("torque", np.float64, (MAX_FINGERS, num_joints)),  # [N m]
        ("estimates", np.float64, (MAX_UNKNOWNS,)),
        ("diagnostics", np.float64, (MAX_DIAGNOSTICS,)),
    ]
    return np.dtype(fields, align=True)


def own_law_layout(seen: Layout, answer: Layout) -> Layout:
    """State of a custom law in a run, with its inputs and outputs."""
    fields = [
        ("address", np.int64),  # address of its code; 0: the run pauses for the command
        ("memory", np.int64),  # address of its memory
        ("asked", np.int64),  # NOTHING, ASKED or ANSWERED
        ("first", np.int64),  # 1 if the waiting tick is the first of the run
        ("stretch", np.int64),  # 1 if it starts a segment
        ("seen", seen),
        ("answer", answer),
    ]
    return np.dtype(fields, align=True)


_PROTOTYPE = ctypes.CFUNCTYPE(ctypes.c_int64, *[ctypes.c_void_p] * 3)


@intrinsic
def _call_compiled(_typing: Any, address: Any, seen: Any, memory: Any, answer: Any) -> Any:
    """Calls machine code by address; passes the addresses of inputs, memory and outputs."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        word = ir.IntType(64)
        pointer = ir.PointerType(ir.FunctionType(word, [word] * 3))
        code, seen_at, memory_at, answer_at = values
        shown, written = (builder.ptrtoint(at, word) for at in (seen_at, answer_at))
        return builder.call(builder.inttoptr(code, pointer), [shown, memory_at, written])

    return types.int64(types.int64, seen, types.int64, answer), generate


def _call_interpreted(address: int, seen: Record, memory: int, answer: Record) -> int:
    status: int = _PROTOTYPE(int(address))(address_of(seen), int(memory), address_of(answer))
    return status


call_law = _call_interpreted if INTERPRETED else _call_compiled


@compiled
def ask(own: Record) -> int:
    """Calls the law; returns 0 on success. An external command is already set."""
    if own.address == 0:
        return 0
    return call_law(own.address, own.seen, own.memory, own.answer)


@compiled
def is_answer_finite(model: Record, answer: Record) -> bool:
    """True if all numbers of a command are finite."""
    total = 0.0
    for i in range(model.num_fingers):
        for joint in range(answer.torque.shape[1]):
            total += abs(answer.torque[i, joint])
    for k in range(model.num_unknowns):
        total += abs(answer.estimates[k])
    for k in range(model.num_diagnostics):
        total += abs(answer.diagnostics[k])
    return total < np.inf


@compiled
def show_fingers(model: Record, hand: Record, believed: Record, seen: Record) -> None:
    """Sets the assumed links and friction of the fingers, gravity and the torque limit.

    Args:
        model: Constants of the run.
        hand: Assumed links.
        believed: Assumed masses and friction.
        seen: Output.
    """
    seen.gravity, seen.torque_limit = model.hand.gravity, model.actuators.torque_limit
    for i in range(model.num_fingers):
        seen.friction[i] = believed.friction[i]
        for link in range(2):
            seen.link_masses[i, link] = believed.link_masses[i, link]
            seen.link_lengths[i, link] = hand.link_lengths[i, link]
            seen.link_centres[i, link] = hand.link_centres[i, link]
