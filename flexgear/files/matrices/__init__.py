"""Exchange of reduced bodies with other programs: stiffness and mass matrices, table of nodes.

body: the matrices, their table of nodes and checks; op4: files of Nastran;
exchange: reading and writing of a body.
"""
