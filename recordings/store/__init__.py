"""The folder of recordings: stored, listed, found, described, uploaded and limited."""
