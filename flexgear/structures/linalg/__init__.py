"""Linear algebra that reductions need beyond SciPy; it knows only arrays."""
