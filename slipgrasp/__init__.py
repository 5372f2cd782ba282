"""Simulation of grasping with slip: the public Python interface.

    import slipgrasp

    scenario = slipgrasp.load_scenario("paper-case-1")
    result = slipgrasp.simulate(slipgrasp.with_values(scenario, {"object.mass": 1.4}))
    slipgrasp.write_recording(result, Path("heavier.mcap"))

Each name is imported when it is first used, so that ``import slipgrasp`` costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from core.batch import simulate_many
    from core.exceptions import ScenarioError, SlipgraspError
    from core.frames import MissingPackageError
    from core.law_choice import with_law
    from core.loading import (
        load_scenario,
        preset_names,
        scenario_from_mapping,
        scenario_to_toml,
        with_values,
    )
    from core.margin import Margin, MarginError, find_margin
    from core.result import Metrics, RunResult, RunSummary
    from core.scenario import Patch, Pulse, Scenario
    from core.simulation import Simulation
    from core.simulator import simulate
    from core.study.definition import Study
    from core.study.loading import load_study, study_from_mapping
    from core.trace import SIGNALS, Trace
    from core.types import ContactPhase, Outcome, PhaseChange, Reason, RunWarning
    from recordings.comparison import Comparison, IncomparableError, compare
    from recordings.exceptions import RecordingError
    from recordings.export import write_csv, write_npz, write_parquet
    from recordings.reader import read_recording as open_recording
    from recordings.study.campaign import run_study
    from recordings.study.rebuild import rebuild_run
    from recordings.study.results import StudyResults
    from recordings.study.results import read_results as open_study
    from recordings.verification import Verification, verify
    from recordings.writer import write_recording

__all__ = [
    "SIGNALS",
    "Comparison",
    "ContactPhase",
    "IncomparableError",
    "Margin",
    "MarginError",
    "Metrics",
    "MissingPackageError",
    "Outcome",
    "Patch",
    "PhaseChange",
    "Pulse",
    "Reason",
    "RecordingError",
    "RunResult",
    "RunSummary",
    "RunWarning",
    "Scenario",
    "ScenarioError",
    "Simulation",
    "SlipgraspError",
    "Study",
    "StudyResults",
    "Trace",
    "Verification",
    "compare",
    "find_margin",
    "load_scenario",
    "load_study",
    "open_recording",
    "open_study",
    "preset_names",
    "rebuild_run",
    "run_study",
    "scenario_from_mapping",
    "scenario_to_toml",
    "simulate",
    "simulate_many",
    "study_from_mapping",
    "verify",
    "with_law",
    "with_values",
    "write_csv",
    "write_npz",
    "write_parquet",
    "write_recording",
]

_ORIGINS = {
    "SIGNALS": "core.trace",
    "Comparison": "recordings.comparison",
    "ContactPhase": "core.types",
    "IncomparableError": "recordings.comparison",
    "Margin": "core.margin",
    "MarginError": "core.margin",
    "Metrics": "core.result",
    "MissingPackageError": "core.frames",
    "Outcome": "core.types",
    "Patch": "core.scenario",
    "PhaseChange": "core.types",
    "Pulse": "core.scenario",
    "Reason": "core.types",
    "RecordingError": "recordings.exceptions",
    "RunResult": "core.result",
    "RunSummary": "core.result",
    "RunWarning": "core.types",
    "Scenario": "core.scenario",
    "ScenarioError": "core.exceptions",
    "Simulation": "core.simulation",
    "SlipgraspError": "core.exceptions",
    "Study": "core.study.definition",
    "StudyResults": "recordings.study.results",
    "Trace": "core.trace",
    "Verification": "recordings.verification",
    "compare": "recordings.comparison",
    "find_margin": "core.margin",
    "load_scenario": "core.loading",
    "load_study": "core.study.loading",
    "open_recording": "recordings.reader:read_recording",
    "open_study": "recordings.study.results:read_results",
    "preset_names": "core.loading",
    "rebuild_run": "recordings.study.rebuild",
    "run_study": "recordings.study.campaign",
    "scenario_from_mapping": "core.loading",
    "scenario_to_toml": "core.loading",
    "simulate": "core.simulator",
    "simulate_many": "core.batch",
    "study_from_mapping": "core.study.loading",
    "verify": "recordings.verification",
    "with_law": "core.law_choice",
    "with_values": "core.loading",
    "write_csv": "recordings.export",
    "write_npz": "recordings.export",
    "write_parquet": "recordings.export",
    "write_recording": "recordings.writer",
}


def __getattr__(name: str) -> Any:
    """Imports a public name when it is first asked for (PEP 562)."""
    if name not in _ORIGINS:
        raise AttributeError(f"module 'slipgrasp' has no attribute '{name}'")
    module, _, attribute = _ORIGINS[name].partition(":")
    value = getattr(import_module(module), attribute or name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
