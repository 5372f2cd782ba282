"""One server for most tests of the REST interface, and one with a viewer."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import httpx2
import pytest

from slipgrasp.core.run.result import RunResult
from slipgrasp.core.run.simulator import prepare_kernel, simulate
from slipgrasp.core.scenario.loading import load_scenario, with_values
from slipgrasp.server.app import create_app
from slipgrasp.server.viewer.relay import add_viewer_routes
from slipgrasp.server.viewer.server import ViewerServer
from tests.server.serving import RunningServer, patient_settings, serve
from tests.server.studying import QUICK, create, finished


@pytest.fixture(scope="session", autouse=True)
def kernel() -> None:
    """Compiled once and waited for here, so that no test takes it for a slow answer."""
    prepare_kernel()


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    with serve(patient_settings(tmp_path_factory.mktemp("data"))) as running:
        yield running


@pytest.fixture
def client(server: RunningServer) -> Iterator[httpx2.Client]:
    with server.client() as client:
        yield client


@pytest.fixture(scope="session")
def sample_run(server: RunningServer) -> dict[str, Any]:
    with server.client() as client:
        answer = client.post("/runs", json={"scenario": "paper-case-1"})
    assert answer.status_code == 201
    run: dict[str, Any] = answer.json()
    return run


@pytest.fixture(scope="session")
def studying(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    folder = tmp_path_factory.mktemp("studied")
    with serve(patient_settings(folder, study_executor="inline")) as running:
        yield running


@pytest.fixture(scope="session")
def studies(studying: RunningServer) -> Iterator[httpx2.Client]:
    with studying.client() as client:
        yield client


@pytest.fixture(scope="session")
def finished_study(studying: RunningServer) -> dict[str, Any]:
    with studying.client() as client:
        return finished(client, create(client, QUICK))


@pytest.fixture(scope="session")
def short_result() -> RunResult:
    return simulate(with_values(load_scenario("paper-case-1"), {"simulation.duration": 0.01}))


@dataclass(frozen=True, slots=True)
class Viewing:
    server: RunningServer
    viewer: ViewerServer


@pytest.fixture(scope="session")
def viewing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Viewing]:
    settings = patient_settings(tmp_path_factory.mktemp("viewed"))
    viewer = ViewerServer(label="test")
    viewer.scene.configure_default_lights(enabled=True, cast_shadow=False)
    app = create_app(settings)
    add_viewer_routes(app, viewer.get_port)
    try:
        with serve(settings, app) as running:
            yield Viewing(running, viewer)
    finally:
        viewer.stop()
