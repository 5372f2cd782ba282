"""Reducers, one per concern of a session: they turn intents into a new view."""
