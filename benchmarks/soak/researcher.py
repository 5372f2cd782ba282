"""A user of the REST interface with a few runs, who checks the responses."""

from __future__ import annotations

import hashlib
import random
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from benchmarks.service import Answer
from benchmarks.soak.asking import Tally
from benchmarks.soak.strangers import BINARY
from benchmarks.study import random_study
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.file.recorder import record

MAX_RUNS = 12
FIXED: dict[str, Any] = {"scenario": "paper-case-2", "set": {"simulation.duration": 1.0}}
LONG = {
    "scenario": "paper-case-1",
    "set": {"simulation.duration": 600.0, "controller.control_period": 0.001},
}
SEARCHES = (
    "preset=paper-case-1&sort=-created&limit=20",
    "metric=slip_path_0<0.01&metric=held=true",
    "outcome=completed&sort=end_time&limit=5",
    "text=mass&offset=3",
    "tag=soak&sort=-slip_path_0",
    "created_from=2000-01-01&created_to=2999-01-01",
)
TOO_SHORT = b"only one instant in common"
PATIENCE = 90.0
POLL = 0.2
RARELY = 0.2


@cache
def fixed_hash() -> str:
    """Hash of the recording of `FIXED`, made in this process."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        record(with_values(load_scenario(FIXED["scenario"]), FIXED["set"]), path)
        return hashlib.sha256(path.read_bytes()).hexdigest()


class Researcher:
    """Performs actions successively, like a script or a person, in a seeded order.

    Args:
        tally: Sends requests, and counts every response.
        seed: Seed of the actions.
    """

    def __init__(self, tally: Tally, seed: int) -> None:
        self._ask, self._expect = tally.ask, tally.expect
        self._source = random.Random(seed)
        self._runs: list[str] = []
        self._habits: dict[Callable[[], None], int] = {
            self._simulate: 10,
            self._send_twice: 2,
            self._repeat: 2,
            self._stop: 2,
            self._read_signals: 6,
            self._export: 6,
            self._download: 3,
            self._search: 4,
            self._annotate: 3,
            self._compare: 3,
            self._upload: 2,
            self._upload_damaged: 3,
            self._study: 2,
            self._cancel_study: 1,
            self._look_around: 2,
        }

    def act(self) -> None:
        """Performs one action, and deletes surplus runs."""
        if len(self._runs) < 2:
            self._simulate()
        action = self._source.choices(list(self._habits), list(self._habits.values()))[0]
        action()
        while len(self._runs) > MAX_RUNS:
            self._delete(self._runs[0])

    def tidy_up(self) -> None:
        """Deletes all of its runs."""
        while self._runs:
            self._delete(self._runs[0])

    # Runs

    def _scenario(self) -> dict[str, Any]:
        values = {
            "object.mass": round(self._source.uniform(0.5, 2.0), 3),
            "fingers.0.friction": round(self._source.uniform(0.1, 0.6), 3),
            "simulation.duration": round(self._source.uniform(0.2, 4.0), 2),
        }
        return {"scenario": self._source.choice(["paper-case-1", "paper-case-2"]), "set": values}

    def _simulate(self) -> None:
        answer = self._ask("run", "POST", "/runs", (201, 202), self._scenario())
        self._runs.append(self._wait_for(answer)["id"])

    def _send_twice(self) -> None:
        body = self._scenario()
        key = {"Idempotency-Key": f"{self._source.getrandbits(64):x}"}
        first = self._wait_for(self._ask("run, keyed", "POST", "/runs", (201, 202), body, key))
        again = self._ask("run, keyed", "POST", "/runs", (201,), body, key)
        self._runs.append(first["id"])
        self._expect("run, keyed", again.json["id"] == first["id"], "a key made two runs")
        self._ask("key of another body", "POST", "/runs", (422,), FIXED, key)

    def _repeat(self) -> None:
        run = self._wait_for(self._ask("run", "POST", "/runs", (201, 202), FIXED))
        self._runs.append(run["id"])
        path = f"/runs/{run['id']}/recording"
        found = hashlib.sha256(self._ask("recording", "GET", path, (200,)).content).hexdigest()
        self._expect("run", found == fixed_hash(), "another recording than one made here")

    def _stop(self) -> None:
        at_once = {"Prefer": "respond-async"}
        begun = self._ask("run, long", "POST", "/runs", (202,), LONG, at_once).json
        self._ask("run going on", "GET", f"/runs/{begun['id']}", (202,))
        self._ask("signals too early", "GET", f"/runs/{begun['id']}/signals", (409,))
        self._ask("delete too early", "DELETE", f"/runs/{begun['id']}", (409,))
        time.sleep(self._source.uniform(0.0, 1.0))
        stopped = self._ask("stop", "POST", f"/runs/{begun['id']}/stop", (200, 202))
        run = self._wait_for(stopped)
        endings = (Outcome.STOPPED, Outcome.COMPLETED)
        self._expect("stop", run["outcome"] in endings, f"a stopped run is {run['outcome']}")
        self._runs.append(run["id"])

    def _wait_for(self, answer: Answer) -> dict[str, Any]:
        """The run of a response, after its end."""
        wait = {"Prefer": "wait=5"}
        until = time.monotonic() + PATIENCE
        while answer.status == 202 and time.monotonic() < until:
            path = f"/runs/{answer.json['id']}"
            answer = self._ask("run going on", "GET", path, (200, 202), None, wait)
        run: dict[str, Any] = answer.json
        self._expect("run", run.get("outcome") in set(Outcome), f"a run without an end: {run}")
        return run

    def _delete(self, run_id: str) -> None:
        self._runs.remove(run_id)
        self._ask("delete", "DELETE", f"/runs/{run_id}", (204,))
        self._ask("run that is gone", "GET", f"/runs/{run_id}", (404,))

    # Reading

    def _read_signals(self) -> None:
        names = self._source.choice(["t,slip", "t,normal_force,phase_0", ""])
        path = f"/runs/{self._source.choice(self._runs)}/signals?names={names}"
        read = self._ask("signals", "GET", path, (200,)).json
        lengths = {len(values) for values in read["signals"].values()}
        self._expect("signals", lengths == {read["count"]}, f"columns of {lengths} values")
        self._ask("signals, unknown", "GET", f"{path},slop", (422,))

    def _export(self) -> None:
        kind = self._source.choice(["csv", "parquet", "npz"])
        path = f"/runs/{self._source.choice(self._runs)}/signals.{kind}"
        whole = self._ask("table", "GET", path, (200,))
        tag, start = whole.headers["etag"], self._source.randrange(len(whole.content))
        self._ask("table, known", "GET", path, (304,), None, {"If-None-Match": tag})
        asked = {"Range": f"bytes={start}-", "If-Range": tag}
        part = self._ask("table, a part", "GET", path, (206,), None, asked)
        self._expect("table", part.content == whole.content[start:], "a part is of another file")

    def _download(self) -> None:
        path = f"/runs/{self._source.choice(self._runs)}"
        size = self._ask("run", "GET", path, (200,)).json["size"]
        content = self._ask("recording", "GET", f"{path}/recording", (200,)).content
        self._expect("recording", len(content) == size, f"{len(content)} of {size} bytes")
        beyond = {"Range": f"bytes={size}-"}
        self._ask("recording, beyond", "GET", f"{path}/recording", (416,), None, beyond)

    def _search(self) -> None:
        query = self._source.choice(SEARCHES)
        found = self._ask("search", "GET", f"/runs?{query}", (200,)).json
        self._expect("search", len(found["data"]) <= found["count"], "more runs than it counts")

    def _annotate(self) -> None:
        path = f"/runs/{self._source.choice(self._runs)}"
        tag = self._ask("run", "GET", path, (200,)).headers["etag"]
        words = {"name": f"run {self._source.randrange(1000)}", "tags": ["soak"]}
        if_match = {"If-Match": tag}
        changed = self._ask("annotation", "PATCH", path, (200,), words, if_match)
        if changed.headers["etag"] != tag:
            self._ask("annotation, late", "PATCH", path, (412,), {"name": "late"}, if_match)
        self._expect("annotation", changed.json["name"] == words["name"], "another name")

    def _compare(self) -> None:
        a, b = self._source.choices(self._runs, k=2)
        told = self._ask("diff", "GET", f"/diff?a={a}&b={b}", (200, 422))
        comparable = told.status == 200
        self._expect("diff", comparable or TOO_SHORT in told.content, f"{told.content!r}")
        if comparable and self._source.random() < RARELY:
            drawn = self._ask("diff drawn", "GET", f"/diff/figure?a={a}&b={b}&format=svg", (200,))
            self._expect("diff drawn", drawn.content.startswith(b"<?xml"), "no picture")

    def _look_around(self) -> None:
        for path in ("/health", "/presets", "/presets/paper-case-1", "/parameters", "/studies"):
            self._ask(path.split("/")[1], "GET", path, (200,))

    # Uploads

    def _recording(self) -> bytes:
        run_id = self._source.choice(self._runs)
        return self._ask("recording", "GET", f"/runs/{run_id}/recording", (200,)).content

    def _upload(self) -> None:
        content = self._recording()
        sent = self._ask("upload", "POST", "/recordings?name=sent", (201,), content, BINARY).json
        self._runs.append(sent["id"])
        back = self._ask("recording", "GET", f"/runs/{sent['id']}/recording", (200,))
        self._expect("upload", back.content == content, "another file came back")

    def _upload_damaged(self) -> None:
        content = bytearray(self._recording())
        if self._source.random() < 0.5:
            del content[self._source.randrange(len(content)) :]
        else:
            place = self._source.randrange(8, len(content) - 8)
            content[place] ^= 1 << self._source.randrange(8)
        self._ask("upload, damaged", "POST", "/recordings", (422,), bytes(content), BINARY)

    # Studies

    def _study(self) -> None:
        kept = self._source.choice(["all", "none"])
        runs = 6 if kept == "all" else self._source.randrange(20, 200)
        study = self._create_study(runs, kept)
        path = f"/studies/{study['id']}"
        ended = self._wait_for_study(path)
        done = ended["state"] == "completed" and ended["finished"] == runs
        self._expect("study", done, f"{ended['state']}, {ended['finished']} of {runs} rows")
        page = self._ask("results", "GET", f"{path}/results?sort=-slip_path_0", (200,)).json
        self._expect("results", page["count"] == runs, f"{page['count']} of {runs} rows")
        for part in ("summary", "results.csv", "results.json", "results.parquet"):
            self._ask("results", "GET", f"{path}/{part}", (200,))
        if self._source.random() < RARELY:
            self._ask("map", "GET", f"{path}/map.svg", (200,))
        row = f"{path}/results/{self._source.randrange(runs)}/recording"
        made = self._ask("run of a study", "POST", row, (200, 201)).headers["location"]
        rows = page["data"] if kept == "all" else []
        for run_id in {made.rpartition("/")[2], *(row["recording"] for row in rows)}:
            self._runs.append(run_id)
        self._ask("delete a study", "DELETE", path, (204,))
        self._ask("study that is gone", "GET", path, (404,))

    def _cancel_study(self) -> None:
        path = f"/studies/{self._create_study(20_000, 'none')['id']}"
        self._ask("delete a study too early", "DELETE", path, (409,))
        time.sleep(self._source.uniform(0.0, 2.0))
        self._ask("cancel", "POST", f"{path}/cancel", (202,))
        ended = self._wait_for_study(path)
        self._expect("cancel", ended["state"] == "cancelled", f"it is {ended['state']}")
        self._ask("delete a study", "DELETE", path, (204,))

    def _create_study(self, runs: int, kept: str) -> dict[str, Any]:
        seed = self._source.randrange(1 << 30)
        ranges = {"object.mass": (0.8, 1.6), "fingers.0.friction": (0.2, 0.5)}
        short = {"simulation.duration": 0.3}
        body = random_study(runs, ranges, seed, set=short, recordings=kept)
        return self._ask("study", "POST", "/studies", (202,), body).json

    def _wait_for_study(self, path: str) -> dict[str, Any]:
        """Follows its events to the end, or requests its status repeatedly."""
        if self._source.random() < 0.5:
            told = self._ask("events", "GET", f"{path}/events?rows=true", (200,)).content
            self._expect("events", b"event: end" in told, "a stream without an end")
        until = time.monotonic() + PATIENCE
        while True:
            study: dict[str, Any] = self._ask("study", "GET", path, (200,)).json
            if study["state"] not in ("queued", "running") or time.monotonic() > until:
                return study
            time.sleep(POLL)
