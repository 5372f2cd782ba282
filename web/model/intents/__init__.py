"""What a user, or a worker on the user's behalf, asks of a session: one module per concern.

Callbacks put intents into the mailbox of their session and return.
"""
