"""Plain NumPy and SciPy versions of the model, written from docs/model.md alone.

Nothing here imports the compiled kernel: where the two agree, both are probably right.
"""
