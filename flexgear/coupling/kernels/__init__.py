"""Compiled loops over gear meshes and rows, and their arrays."""
