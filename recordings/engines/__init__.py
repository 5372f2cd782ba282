"""Scenarios as scenes of other engines, with the answer that slipgrasp expects of them."""
