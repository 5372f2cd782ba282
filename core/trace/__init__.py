"""The signals of a run over time, as arrays, named columns and data frames."""
