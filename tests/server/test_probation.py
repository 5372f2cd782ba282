"""How long those have to wait whose viewers were sent away."""

from __future__ import annotations

from slipgrasp.server.viewer.probation import FAULT_SECONDS, LONGEST_SECONDS, Probation


def test_nobody_waits_without_a_fault() -> None:
    assert Probation(clock=lambda: 5.0).time_left("10.0.0.1") == 0.0


def test_each_fault_makes_its_peer_wait_longer_and_nobody_else() -> None:
    now = [5.0]
    probation = Probation(clock=lambda: now[0])
    for _ in range(2):
        probation.note_fault("10.0.0.1")
    assert probation.time_left("10.0.0.1") == 2 * FAULT_SECONDS
    assert probation.time_left("10.0.0.2") == 0.0
    now[0] += 1.5 * FAULT_SECONDS
    assert probation.time_left("10.0.0.1") == 0.5 * FAULT_SECONDS
    now[0] += FAULT_SECONDS
    assert probation.time_left("10.0.0.1") == 0.0


def test_nobody_waits_without_end() -> None:
    probation = Probation(clock=lambda: 5.0)
    for _ in range(100):
        probation.note_fault("10.0.0.1")
    assert probation.time_left("10.0.0.1") == LONGEST_SECONDS


def test_whose_time_is_over_is_forgotten() -> None:
    now = [5.0]
    probation = Probation(clock=lambda: now[0])
    for number in range(100):
        probation.note_fault(f"10.0.0.{number}")
        now[0] += LONGEST_SECONDS
    assert len(probation._until) == 1
