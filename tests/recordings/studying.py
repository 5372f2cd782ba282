"""Small studies that are really run, in this process."""

from slipgrasp.core.executors import make_executor
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping
from slipgrasp.core.study.loading import study_from_mapping
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.recordings.study.scheduler import schedule_runs
from slipgrasp.recordings.study.writer import StudyWriter


def make_study(**document):
    def find_base(base):
        return load_scenario(base) if isinstance(base, str) else scenario_from_mapping(base)

    return study_from_mapping({"base": "paper-case-1", "recordings": "none", **document}, find_base)


def run_study(study, path, *, until=None):
    """Runs a study into a file; with ``until`` it is told to stop behind so many rows."""
    results = StudyResults(study)
    with make_executor("inline") as executor, StudyWriter(path, study) as writer:
        end = schedule_runs(
            study,
            executor,
            writer,
            should_stop=lambda: until is not None and results.num_rows >= until,
            watch=results.append,
            keep=lambda member: None,
        )
        if end.state == "completed":
            writer.finish(end)
    return results
