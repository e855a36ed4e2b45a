"""ISO/TR 6336-30:2017, example 1: a helical pair rated after ISO 6336-1, -2 and -5."""
