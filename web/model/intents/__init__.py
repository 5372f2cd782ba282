"""Requests to a session by the user or a worker: one module per concern.

Callbacks put intents into the mailbox of their session and return.
"""
