"""Runs on a server, followed to their end however long the machine takes."""

from __future__ import annotations

from typing import Any

import httpx2

from tests.waiting import wait_until

AT_ONCE = {"Prefer": "respond-async"}


def run_to_end(client: httpx2.Client, body: Any, **headers: str) -> dict[str, Any]:
    """The run that is made of a request, once it has ended.

    Args:
        client: Asks the server.
        body: The request.
        headers: What else it says.
    """
    return ended(client, client.post("/runs", json=body, headers={**AT_ONCE, **headers}))


def stop_to_end(client: httpx2.Client, run_id: str) -> dict[str, Any]:
    """A run that was told to stop, once it has ended."""
    return ended(client, client.post(f"/runs/{run_id}/stop", headers=AT_ONCE))


def ended(client: httpx2.Client, answer: httpx2.Response) -> dict[str, Any]:
    """The run that an answer tells of, once it has ended; asked for as long as it has not."""
    last = end_of(client, answer)
    assert last.status_code in (200, 201), last.text
    run: dict[str, Any] = last.json()
    return run


def end_of(
    client: httpx2.Client, answer: httpx2.Response, prefer: str = "respond-async"
) -> httpx2.Response:
    """The first answer about a run that is not that it goes on.

    Args:
        client: Asks the server.
        answer: What it said of the run before.
        prefer: How each question is to be answered.
    """
    answers = [answer]

    def is_over() -> bool:
        if answers[-1].status_code == 202:
            path = f"/runs/{answer.json()['id']}"
            answers.append(client.get(path, headers={"Prefer": prefer}))
        return answers[-1].status_code != 202

    wait_until(is_over, lambda: answers[-1].text)
    return answers[-1]
