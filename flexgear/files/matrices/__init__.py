"""Reduced matrices of other programs and for them: stiffness, mass and a table of nodes.

body: the matrices and their table of nodes with checks; op4, entries: formats; exchange: reading
and writing.
"""
