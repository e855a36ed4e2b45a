"""Labelled results: datasets with units and parameters, load sharing, harmonics, summaries."""
