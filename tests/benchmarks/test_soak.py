"""A few seconds of mixed load; ``python -m benchmarks soak`` does an hour."""

import json

import pytest

from benchmarks.service import Answer
from benchmarks.soak import PAUSES, Sample, Soak, soak, tabulate, visitors
from benchmarks.soak.asking import Tally, find_faults

SAFE = {"x-content-type-options": "nosniff"}
PROBLEM = SAFE | {"content-type": "application/problem+json"}


def problem(status, **told):
    body = {"status": status, "detail": "words"} | told
    return Answer(status, PROBLEM, json.dumps(body).encode())


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (Answer(500, SAFE, b""), "500 b''"),
        (Answer(200, {}, b""), "without the safe headers"),
        (problem(503), "without Retry-After"),
        (Answer(404, SAFE, b"no"), "without problem details"),
        (Answer(404, SAFE, b'{"status": 404, "detail": "x"}'), "other problem details"),
        (Answer(404, PROBLEM, b'{"status": 422, "detail": "x"}'), "other problem details"),
        (problem(404, detail="Traceback (most recent"), "does not say what is wrong"),
    ],
)
def test_an_answer_that_is_not_as_specified_is_a_fault(answer, words):
    assert words in find_faults(answer, (200, 404, 503))[0]


def test_an_answer_as_specified_is_none():
    assert find_faults(Answer(200, SAFE, b""), (200,)) == []
    assert find_faults(problem(404), (404,)) == []


def test_the_slope_is_that_of_the_memory_at_rest():
    growing = [300_000_000 + 7_000_000 * k for k in range(8)]
    rests = [Sample(3600.0 * k, 400_000_000, own, 0, 17) for k, own in enumerate(growing)]
    table = tabulate(Soak(Tally(("", 0)), rests, rests, ""))
    rows = {row[0]: row[1] for row in table.rows}
    assert rows["slope of that"] == "+7.0 ± 0.0 MB/h"


@pytest.mark.slow
def test_everything_is_answered_as_specified_for_some_seconds(monkeypatch):
    look_on = visitors._look_on  # Who looks on for a quarter of a minute leaves last.
    monkeypatch.setattr(visitors, "_look_on", lambda *args: look_on(*args[:2], 0.2 * args[2]))
    for actor, pause in list(PAUSES.items()):
        monkeypatch.setitem(PAUSES, actor, 0.2 * pause)
    found = soak(seconds=3.0, seed=4, spell=3.0, rest=0.5)
    assert found.tally.faults == []
    assert found.tracebacks == 0
    kinds = {kind for kind, _ in found.tally.counts}
    assert {"run", "viewer", "half a head"} & kinds and found.tally.total > 20
    assert found.samples[-1].descriptors < 100
