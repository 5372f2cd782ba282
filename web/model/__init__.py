"""What the page shows, as frozen values, and the intents that ask to change it."""
