"""Studies that are over in a moment, and one that outlasts every test."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import httpx2

from tests.waiting import wait_until

QUICK: dict[str, Any] = {
    "title": "Mass and friction",
    "base": "paper-case-1",
    "set": {"simulation.duration": 0.5},
    "sampling": {"method": "latin-hypercube", "runs": 20, "seed": 3},
    "vary": {
        "object.mass": {"min": 0.8, "max": 1.6},
        "fingers.0.friction": {"min": 0.2, "max": 0.6},
        "controller.lyapunov_weight": {"values": [1.0, 20.0]},
    },
    "recordings": "none",
}
# Of many runs and no long ones: a service simulates some of them for its estimate.
LONG: dict[str, Any] = {
    **QUICK,
    "set": {"simulation.duration": 2.0, "simulation.max_step": 0.0005},
    "sampling": {"method": "latin-hypercube", "runs": 1500, "seed": 3},
}


def create(client: httpx2.Client, body: dict[str, Any], key: str = "") -> dict[str, Any]:
    """The study that is made of a request."""
    answer = client.post("/studies", json=body, headers={"Idempotency-Key": key} if key else {})
    assert answer.status_code == 202, answer.text
    study: dict[str, Any] = answer.json()
    return study


def finished(client: httpx2.Client, study: dict[str, Any]) -> dict[str, Any]:
    """The study once it has ended."""
    return until(client, study, lambda now: now["state"] not in ("queued", "running"))


def until(
    client: httpx2.Client, study: dict[str, Any], holds: Callable[[dict[str, Any]], bool]
) -> dict[str, Any]:
    """The study as soon as something is true of it."""
    now: dict[str, Any] = {}

    def is_so() -> bool:
        now.update(client.get(f"/studies/{study['id']}").json())
        return holds(now)

    wait_until(is_so, lambda: now)
    return now
