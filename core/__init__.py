"""The model: scenario, hybrid dynamics, controller, simulator, trace. No files, HTTP or GUI."""
