"""Routes of the REST interface; `slipgrasp.server.runs.service` contains the logic."""
