"""One recording: the MCAP file, what is in it, how it is written, read and recovered."""
