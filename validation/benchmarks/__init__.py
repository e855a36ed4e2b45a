"""Ratios of speed, each measured in one run on the same matrices or the same case: `make bench`."""
