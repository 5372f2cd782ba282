"""Studies in the page: what is asked for, how far it is, and the map of what came out."""
