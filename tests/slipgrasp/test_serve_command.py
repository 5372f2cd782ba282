import json
import re
import signal
import socket
import urllib.error
import urllib.request
from contextlib import contextmanager

import pytest

from slipgrasp.core.scenario.loading import load_scenario, scenario_to_toml
from slipgrasp.core.trace.types import Outcome
from slipgrasp.recordings.file.reader import read_recording
from tests.waiting import PATIENCE, wait_until

pytestmark = pytest.mark.slow


@contextmanager
def serving(slipgrasp, *arguments):
    """A server process and its URL; it is ended by SIGINT if the test has not done so."""
    process = slipgrasp.start("serve", *arguments)
    with process:
        try:
            url = process.stdout.readline()
            assert url, process.stderr.read()
            yield process, url
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            process.wait(timeout=PATIENCE)


def post_run(url, values):
    body = {"scenario": "paper-case-1", "set": values}
    headers = {"Content-Type": "application/json", "Prefer": "respond-async"}
    asked = urllib.request.Request(f"{url.strip()}api/v1/runs", json.dumps(body).encode(), headers)
    with urllib.request.urlopen(asked) as answer:
        return json.load(answer)["id"]


def test_a_server_tells_its_url_answers_keeps_runs_in_its_folder_and_ends_by_a_signal(
    slipgrasp, tmp_path
):
    arguments = ("--port", "0", "--data-dir", tmp_path / "kept")
    with serving(slipgrasp, *arguments) as (process, url):
        assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\n", url)
        with urllib.request.urlopen(url.strip()) as page:
            assert page.status == 200
        recording = tmp_path / "kept" / f"{post_run(url, {'simulation.duration': 0.3})}.mcap"
        wait_until(recording.is_file)
        done = slipgrasp("serve", "--port", "0", *arguments[2:])
        assert (done.returncode, done.stdout) == (2, "")
        assert f"process {process.pid}" in done.stderr and "--data-dir" in done.stderr
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=PATIENCE) == 0
        assert "Traceback" not in process.stderr.read()


def test_a_server_that_is_ended_keeps_what_its_runs_have_simulated(slipgrasp):
    endless = {"simulation.duration": 600, "controller.control_period": 0.0001}
    with serving(slipgrasp, "--port", "0") as (process, url):
        ids = [post_run(url, endless) for _ in range(3)]
        recordings = [slipgrasp.data / f"{run_id}.mcap" for run_id in ids]
        parts = [path.with_name(f"{path.name}.part") for path in recordings]
        wait_until(lambda: all(part.exists() for part in parts[:2]))
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=PATIENCE) == 0
    for path in recordings[:2]:
        assert read_recording(path).outcome is Outcome.STOPPED
    assert not any(path.exists() for path in (recordings[2], *parts))


def test_a_json_log_has_nothing_but_objects_and_no_token(slipgrasp):
    public = ("--public-url", "https://grasp.example")
    with serving(slipgrasp, "--port", "0", "--log-format", "json", *public) as (process, link):
        tokens = [path.read_text().strip() for path in slipgrasp.data.glob("service.*token")]
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=PATIENCE) == 0
        told = process.stderr.read()
    assert len(tokens) == 2 and any(token in link for token in tokens)
    assert not any(token in told for token in tokens)
    assert all(isinstance(json.loads(line), dict) for line in told.splitlines())


def test_a_taken_port_is_an_error_and_never_silently_another(slipgrasp):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        done = slipgrasp("serve", "--port", port)

    assert done.returncode == 2
    assert done.stdout == ""
    assert f"port {port} is in use" in done.stderr
    assert "--port 0" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    ("argument", "words"),
    [
        ("--port=65536", "is not a port"),
        ("--port=http", "is not a port"),
        ("--quota=many", "is not a size"),
        ("--quota=5 EB", "is not a size"),
        ("--data-dir=file/runs", "file/runs"),
        ("--executor=abacus", "'abacus' is not an executor"),
    ],
)
def test_a_wrong_argument_is_refused_in_one_line(slipgrasp, tmp_path, argument, words):
    (tmp_path / "file").write_text("")
    done = slipgrasp("serve", "--port", "0", argument)
    assert (done.returncode, done.stdout) == (2, "")
    assert words in done.stderr and done.stderr.count("\n") == 1


def test_a_server_starts_with_a_hand_without_its_meshes_and_keeps_to_its_quota(slipgrasp, tmp_path):
    scenario = tmp_path / "hand.toml"
    scenario.write_text(scenario_to_toml(load_scenario("trifinger")))
    limits = ("--quota", "0.5 kB", "--min-free", "1")
    with serving(slipgrasp, "--port", "0", "--hand", scenario, *limits) as (process, url):
        slipgrasp.data.joinpath("notes.txt").write_bytes(bytes(600))
        with pytest.raises(urllib.error.HTTPError) as refused:
            post_run(url, {})
        with refused.value as answer:
            assert answer.code == 507
        with urllib.request.urlopen(url.strip()) as page:
            assert page.status == 200
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=PATIENCE) == 0
        assert "no meshes: '" in process.stderr.read()
