"""Runs: simulation, metrics and outcomes, single or many."""
