"""Hu et al. 2023, load sharing of a three-stage pitch drive, DOI 10.3390/pr11020544."""
