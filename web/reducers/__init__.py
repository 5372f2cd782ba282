"""The concerns of a session, one reducer each: intents go in, a new view comes out."""
