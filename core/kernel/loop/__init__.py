"""Shared by the loops of both mechanics: motions, searches inside a step, energy."""
