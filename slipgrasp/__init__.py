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
    from slipgrasp.core.exceptions import ScenarioError, SlipgraspError
    from slipgrasp.core.run.batch import simulate_many
    from slipgrasp.core.run.result import Metrics, RunResult, RunSummary
    from slipgrasp.core.run.simulation import Simulation
    from slipgrasp.core.run.simulator import simulate
    from slipgrasp.core.scenario import Patch, Pulse, Scenario
    from slipgrasp.core.scenario.law_choice import with_law
    from slipgrasp.core.scenario.loading import (
        load_scenario,
        preset_names,
        scenario_from_mapping,
        scenario_to_toml,
        with_values,
    )
    from slipgrasp.core.study.definition import Study
    from slipgrasp.core.study.loading import load_study, study_from_mapping
    from slipgrasp.core.study.margin import Margin, MarginError, find_margin
    from slipgrasp.core.trace.frames import MissingPackageError
    from slipgrasp.core.trace.trace import SIGNALS, Trace
    from slipgrasp.core.trace.types import ContactPhase, Outcome, PhaseChange, Reason, RunWarning
    from slipgrasp.recordings.compare.comparison import Comparison, IncomparableError, compare
    from slipgrasp.recordings.compare.verification import Verification, verify
    from slipgrasp.recordings.exceptions import RecordingError
    from slipgrasp.recordings.export import write_csv, write_npz, write_parquet
    from slipgrasp.recordings.file.reader import read_recording as open_recording
    from slipgrasp.recordings.file.writer import write_recording
    from slipgrasp.recordings.study.rebuild import rebuild_run
    from slipgrasp.recordings.study.results import StudyResults
    from slipgrasp.recordings.study.results import read_results as open_study
    from slipgrasp.recordings.study.run_study import run_study

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
    "SIGNALS": "slipgrasp.core.trace.trace",
    "Comparison": "slipgrasp.recordings.compare.comparison",
    "ContactPhase": "slipgrasp.core.trace.types",
    "IncomparableError": "slipgrasp.recordings.compare.comparison",
    "Margin": "slipgrasp.core.study.margin",
    "MarginError": "slipgrasp.core.study.margin",
    "Metrics": "slipgrasp.core.run.result",
    "MissingPackageError": "slipgrasp.core.trace.frames",
    "Outcome": "slipgrasp.core.trace.types",
    "Patch": "slipgrasp.core.scenario",
    "PhaseChange": "slipgrasp.core.trace.types",
    "Pulse": "slipgrasp.core.scenario",
    "Reason": "slipgrasp.core.trace.types",
    "RecordingError": "slipgrasp.recordings.exceptions",
    "RunResult": "slipgrasp.core.run.result",
    "RunSummary": "slipgrasp.core.run.result",
    "RunWarning": "slipgrasp.core.trace.types",
    "Scenario": "slipgrasp.core.scenario",
    "ScenarioError": "slipgrasp.core.exceptions",
    "Simulation": "slipgrasp.core.run.simulation",
    "SlipgraspError": "slipgrasp.core.exceptions",
    "Study": "slipgrasp.core.study.definition",
    "StudyResults": "slipgrasp.recordings.study.results",
    "Trace": "slipgrasp.core.trace.trace",
    "Verification": "slipgrasp.recordings.compare.verification",
    "compare": "slipgrasp.recordings.compare.comparison",
    "find_margin": "slipgrasp.core.study.margin",
    "load_scenario": "slipgrasp.core.scenario.loading",
    "load_study": "slipgrasp.core.study.loading",
    "open_recording": "slipgrasp.recordings.file.reader:read_recording",
    "open_study": "slipgrasp.recordings.study.results:read_results",
    "preset_names": "slipgrasp.core.scenario.loading",
    "rebuild_run": "slipgrasp.recordings.study.rebuild",
    "run_study": "slipgrasp.recordings.study.run_study",
    "scenario_from_mapping": "slipgrasp.core.scenario.loading",
    "scenario_to_toml": "slipgrasp.core.scenario.loading",
    "simulate": "slipgrasp.core.run.simulator",
    "simulate_many": "slipgrasp.core.run.batch",
    "study_from_mapping": "slipgrasp.core.study.loading",
    "verify": "slipgrasp.recordings.compare.verification",
    "with_law": "slipgrasp.core.scenario.law_choice",
    "with_values": "slipgrasp.core.scenario.loading",
    "write_csv": "slipgrasp.recordings.export",
    "write_npz": "slipgrasp.recordings.export",
    "write_parquet": "slipgrasp.recordings.export",
    "write_recording": "slipgrasp.recordings.file.writer",
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
