"""Measured data in the folder of a service: listed with their kind, downloaded, not simulated."""

from __future__ import annotations

from pathlib import Path

import pytest

from slipgrasp.recordings.measured.csv_import import ImportOptions, import_csv
from slipgrasp.recordings.store.store import RecordingStore
from slipgrasp.web.panels.recordings_panel import row_words
from tests.server.serving import patient_settings, serve


@pytest.fixture
def stored(tmp_path: Path):
    (tmp_path / "data.csv").write_text("t_s,x_m\n0,1\n1,2\n")
    store = RecordingStore(tmp_path / "runs")
    place = store.reserve()
    mapping = {"t": "t_s", "x": "x_m"}
    options = ImportOptions(mapping=mapping, title="cube")
    outline = import_csv(tmp_path / "data.csv", place.path, options)
    return store.register_measured(place, outline)


def test_measured_data_are_listed_with_their_kind_and_have_no_signals_of_a_run(stored) -> None:
    with serve(patient_settings(stored.path.parent)) as running, running.client() as client:
        (listed,) = client.get("/runs").json()["data"]
        assert (listed["id"], listed["kind"], listed["outcome"]) == (stored.id, "measured", None)
        assert listed["display_name"] == "cube"
        assert set(listed["links"]) == {"self", "recording"}
        assert client.get(f"/runs/{stored.id}/recording").content == stored.path.read_bytes()
        refused = client.get(f"/runs/{stored.id}/signals")
    assert refused.status_code == 422
    assert "contains measured data" in refused.json()["detail"]


def test_a_row_of_the_dashboard_calls_measured_data_measured(stored) -> None:
    words = row_words(stored)

    assert (words.label, words.outcome) == ("cube", "measured")
    assert "measured x; 2 samples" in words.details
