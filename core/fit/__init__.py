"""Fits of measured data: parameters of a scenario, with intervals and what they rest on."""
