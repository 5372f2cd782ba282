"""Fits as files: every run a row of a study, a journal to continue after a kill."""
