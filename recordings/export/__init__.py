"""Runs in formats of other tools: CSV, Parquet, NPZ and an animated picture."""

from slipgrasp.recordings.export.csv_table import csv_columns, write_csv
from slipgrasp.recordings.export.npz_arrays import write_npz
from slipgrasp.recordings.export.parquet_table import write_parquet

__all__ = ["csv_columns", "write_csv", "write_npz", "write_parquet"]
