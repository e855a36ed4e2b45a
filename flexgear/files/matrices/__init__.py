"""Exchange of reduced bodies with other programs: stiffness and mass matrices, table of nodes.

body: the matrices, their table of nodes and checks; formats: parsers of the file formats;
exchange: reading and writing of a body.
"""
