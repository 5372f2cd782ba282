"""Routes of the REST interface: they translate, `slipgrasp.server.runs.run_service` decides."""
