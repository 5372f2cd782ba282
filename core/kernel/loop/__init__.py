"""Common code of both loops: motions, searches inside a step, energy."""
