"""The compiled part: plant, controller, stepper and events in one numba kernel."""
