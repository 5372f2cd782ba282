"""Fits of scenario parameters to measured data, with intervals and evidence."""
