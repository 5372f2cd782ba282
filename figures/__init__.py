"""The figures of a run for print, after the paper's Fig. 4 to 10, as SVG, PDF and PNG.

Most of its modules import matplotlib, so only what draws figures should import them; what a map
shows (`map_data`, `map_labels`) comes without.
"""
