import re
import signal
import urllib.request
from contextlib import contextmanager

import pytest

from tests.waiting import PATIENCE

pytestmark = pytest.mark.slow


@contextmanager
def replaying(slipgrasp, *arguments):
    """A server process that replays, and its URL."""
    process = slipgrasp.start("replay", *arguments, "--port", "0")
    with process:
        try:
            url = process.stdout.readline()
            assert url, process.stderr.read()
            yield url.strip()
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
            assert process.wait(timeout=PATIENCE) == 0


@pytest.fixture
def recording(slipgrasp):
    slipgrasp.run_json("paper-case-1", "--set", "simulation.duration=3")
    return next(slipgrasp.data.glob("*.mcap"))


def test_a_replay_by_id_shares_the_folder_with_a_service_that_runs(slipgrasp, recording):
    service = slipgrasp.start("serve", "--port", "0")
    with service:
        try:
            assert service.stdout.readline(), service.stderr.read()
            with replaying(slipgrasp, recording.stem) as url, urllib.request.urlopen(url) as page:
                assert re.fullmatch(r"http://127\.0\.0\.1:\d+/", url)
                assert page.status == 200
        finally:
            service.send_signal(signal.SIGINT)
            service.wait(timeout=PATIENCE)


def refused(slipgrasp, argument):
    """What is said about it, in one line, before anything starts."""
    done = slipgrasp("replay", argument, "--port", "0")
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    return done.stderr


def test_a_damaged_file_is_refused(slipgrasp, recording):
    content = bytearray(recording.read_bytes())
    content[len(content) // 2] ^= 1
    recording.write_bytes(content)

    assert "damaged" in refused(slipgrasp, recording)


def test_a_foreign_file_is_refused(slipgrasp, tmp_path):
    (tmp_path / "other.mcap").write_bytes(b"PK\x03\x04 something else" * 100)

    assert "other.mcap" in refused(slipgrasp, tmp_path / "other.mcap")


@pytest.mark.parametrize("missing", ["abcdefghijkl", "nothing.mcap", "nothing.mcap.part"])
def test_what_is_not_there_is_refused(slipgrasp, missing):
    assert missing.removesuffix(".part") in refused(slipgrasp, missing)


def test_an_unfinished_file_is_shown_as_far_as_it_goes(slipgrasp, recording):
    part = recording.with_name(f"{recording.name}.part")
    part.write_bytes(recording.read_bytes()[: recording.stat().st_size * 3 // 4])
    recording.unlink()

    with replaying(slipgrasp, part) as url, urllib.request.urlopen(url) as page:
        assert page.status == 200
