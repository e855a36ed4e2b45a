"""Reduced matrices of other programs and for them: stiffness, mass and a table of nodes.

body: the matrices with checks; nodes: the table; op4, dmig, abaqus: formats; reading, writing.
"""
