"""Figures of a run for print, like the paper's Fig. 4 to 10, as SVG, PDF and PNG.

Most modules import matplotlib, so that only code that draws should import them; the content of maps
(`map_data`, `map_labels`) does not need it.
"""
