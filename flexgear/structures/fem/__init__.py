"""Finite elements: stiffness, mass and interface ties. The only place that imports scikit-fem."""
