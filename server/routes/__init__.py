"""Routes of the REST interface: they translate, `slipgrasp.server.runs.service` decides."""
