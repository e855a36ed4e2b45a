"""Ren et al. 2021, load sharing of a herringbone stage, DOI 10.1155/2021/5511817."""
