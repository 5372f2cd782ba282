"""A run: simulated to its end, measured, judged, alone or as one of many."""
