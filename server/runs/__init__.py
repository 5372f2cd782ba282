"""Single runs on request: simulation, storage, search."""
