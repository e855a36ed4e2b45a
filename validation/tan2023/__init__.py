"""Tan et al. 2023, DOI 10.16385/j.cnki.issn.1004-4523.2023.05.002: figures and statements."""
