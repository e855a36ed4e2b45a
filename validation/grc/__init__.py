"""Keller, Guo et al. 2018 and 2020, NREL GRC gearbox: DOI 10.5194/wes-3-947-2018."""
