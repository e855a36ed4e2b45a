"""Verdicts and tables of reports, with labels and units for readers."""
