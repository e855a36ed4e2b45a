"""Loops of equilibria and time steps that are compiled, and the arrays that they take."""
