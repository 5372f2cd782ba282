"""Hands as files describe them: fingers of a scenario are made of their links and joints."""
