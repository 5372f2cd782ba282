"""Fits as files: every run in a study, and a journal for continuation after a kill."""
