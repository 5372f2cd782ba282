"""The concerns of a session, one desk each: intents go in, a new view comes out."""
