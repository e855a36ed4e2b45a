"""Reduced matrices of other programs and for them: stiffness, mass and a table of nodes.

body: the matrices and their table of nodes with checks; formats; exchange: reading and writing.
"""
