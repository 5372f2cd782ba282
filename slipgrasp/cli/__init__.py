"""The command line: one module per command; heavy imports are deferred until a command runs."""
