"""Every name of the public Python interface, where it comes from.

`slipgrasp` gives these names on; importing this module takes half a second.
"""

from slipgrasp.core.exceptions import ScenarioError, SlipgraspError
from slipgrasp.core.fit.fit import FitOptions
from slipgrasp.core.fit.problem import FitError, FitProblem, Observations
from slipgrasp.core.fit.report import FitReport
from slipgrasp.core.run.batch import simulate_many
from slipgrasp.core.run.metrics import Metrics
from slipgrasp.core.run.result import RunResult, RunSummary
from slipgrasp.core.run.simulation import Simulation
from slipgrasp.core.run.simulator import simulate
from slipgrasp.core.scenario import Patch, Pulse, Scenario
from slipgrasp.core.scenario.custom_laws import LawParameter
from slipgrasp.core.scenario.law_choice import with_law
from slipgrasp.core.scenario.law_loading import LawError, load_law, register_law
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
from slipgrasp.core.trace.signals import SIGNALS
from slipgrasp.core.trace.ticks import Ticks
from slipgrasp.core.trace.trace import Trace
from slipgrasp.core.trace.types import ContactPhase, Outcome, PhaseChange, Reason, RunWarning
from slipgrasp.notebook import show
from slipgrasp.recordings.compare.comparison import Comparison, IncomparableError, compare
from slipgrasp.recordings.compare.verification import Verification, verify
from slipgrasp.recordings.exceptions import RecordingError
from slipgrasp.recordings.export import write_csv, write_npz, write_parquet
from slipgrasp.recordings.file.reader import read_recording as open_recording
from slipgrasp.recordings.file.writer import write_recording
from slipgrasp.recordings.fit.run_fit import read_observations, run_fit
from slipgrasp.recordings.measured.csv_import import ImportOptions, import_csv
from slipgrasp.recordings.measured.recording import read_measured as open_measured
from slipgrasp.recordings.study.rebuild import rebuild_run
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.recordings.study.results import read_results as open_study
from slipgrasp.recordings.study.run_study import run_study
