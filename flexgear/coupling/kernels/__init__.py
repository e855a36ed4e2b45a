"""Loops over gear meshes and rows that are compiled, and the arrays that they take."""
