"""Results of a study: access to the rows, summaries and export."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import BinaryIO, TextIO

from slipgrasp.recordings.study.reader import open_study
from slipgrasp.recordings.study.result_table import ResultTable
from slipgrasp.recordings.study.results_comparison import (
    CombinationComparison,
    compare_combinations,
)
from slipgrasp.recordings.study.results_export import write_csv, write_json, write_parquet
from slipgrasp.recordings.study.results_summary import StudySummary, summarize


class StudyResults(ResultTable):
    """The results of a study: one row per run, in the order of their indices."""

    def summary(self) -> StudySummary:
        """Numbers of runs by outcome, and statistics of the metrics."""
        return summarize(self.first(self.num_rows))

    def compare_combinations(self) -> CombinationComparison | None:
        """Comparison of the crossed values on the same samples; None if none are crossed."""
        return compare_combinations(self.first(self.num_rows))

    def write_csv(self, stream: TextIO) -> None:
        """Writes all rows as comma-separated values; see `results_export.write_csv`."""
        write_csv(self, stream)

    def write_parquet(self, stream: BinaryIO) -> None:
        """Writes all rows as a Parquet file; see `results_export.write_parquet`."""
        write_parquet(self, stream)

    def write_json(self, stream: TextIO) -> None:
        """Writes all rows as one JSON document; see `results_export.write_json`."""
        write_json(self, stream)


def read_results(path: str | PathLike[str]) -> StudyResults:
    """Reads the results in the file of a study; for an unfinished one (``.part``), those so far.

    Raises:
        RecordingError: If it cannot be read, or is not the file of a study.
    """
    with open_study(Path(path)) as reader:
        results = StudyResults(reader.study)
        for row in reader.rows():
            results.append(row)
    return results
