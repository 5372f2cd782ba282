"""Routes of the REST interface: they translate, `server.run_service` decides."""
