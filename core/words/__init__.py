"""What is said of a run, in sentences: how it ended, why, what to try, what it is called."""
