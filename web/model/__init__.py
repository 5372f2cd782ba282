"""State of the page as frozen values, and intents that change it."""
