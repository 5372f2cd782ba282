"""The figures of a run for print, after the paper's Fig. 4 to 10, as SVG, PDF and PNG.

Importing this package imports matplotlib, so only what draws figures should do so.
"""

from slipgrasp.figures.drawings import draw_figures, figure_names
from slipgrasp.figures.files import FORMATS, check_folder, write_figures

__all__ = ["FORMATS", "check_folder", "draw_figures", "figure_names", "write_figures"]
