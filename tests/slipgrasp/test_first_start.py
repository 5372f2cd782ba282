"""What the command line says while the simulation is compiled."""

import pytest

from slipgrasp.cli.progress import load_simulation
from slipgrasp.core.run import simulator
from slipgrasp.core.scenario.loading import load_scenario


@pytest.mark.parametrize(
    ("preset", "what"),
    [
        ("paper-case-1", "planar hands"),
        ("spatial-box", "spatial hands"),
        ("sliding-block", "slides"),
    ],
)
def test_the_first_start_says_what_it_compiles_and_for_how_long(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], preset: str, what: str
) -> None:
    monkeypatch.setattr(simulator, "kernel_is_cached", lambda *_, **__: False)
    monkeypatch.setattr(simulator, "kernel_progress", lambda **_: 0.0)
    monkeypatch.setattr(simulator, "prepare_kernel", lambda show, *_, **__: show(0.0))
    monkeypatch.setattr("slipgrasp.cli.progress.LINE_PERIOD", 0.0)
    load_simulation(load_scenario(preset))
    first, second = capsys.readouterr().err.splitlines()
    assert first.startswith(f"slipgrasp: compiling the simulation of {what} for this processor")
    assert "half a minute to two minutes, longer on a busy machine" in first
    assert second.startswith(first) and ": 0%, half a minute or more to go" in second
