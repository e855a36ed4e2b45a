"""Rebouças 2020: the NREL 5 MW gearbox of this package's case rated by KISSsoft, ISO 6336:2006."""
