"""Small studies that are really run, in this process."""

from slipgrasp.core.executors.inline import InlineExecutor
from slipgrasp.core.scenario.loading import load_scenario, scenario_from_mapping
from slipgrasp.core.study.loading import study_from_mapping
from slipgrasp.recordings.study import scheduler
from slipgrasp.recordings.study.results import StudyResults
from slipgrasp.recordings.study.writer import StudyWriter


def make_study(**document):
    def find_base(base):
        return load_scenario(base) if isinstance(base, str) else scenario_from_mapping(base)

    return study_from_mapping({"base": "paper-case-1", "recordings": "none", **document}, find_base)


def run_study(study, path, *, until=None):
    """Runs a study into a file; with ``until`` it is told to stop behind so many rows."""
    results = StudyResults(study)
    write_study(study, path, results.append, lambda: until and results.num_rows >= until)
    return results


def write_study(
    study,
    path,
    watch=lambda row: None,
    should_stop=lambda: False,
    executor=None,
    keep=lambda run: None,
):
    """Runs a study into a file, which is finished unless it is told to stop.

    Returns:
        How the study ended.
    """
    with executor or InlineExecutor() as used, StudyWriter(path, study) as writer:
        options = {"should_stop": should_stop, "watch": watch, "keep": keep}
        end = scheduler.schedule_runs(study, used, writer, **options)
        if end.state == "completed":
            writer.finish(end)
    return end
