"""REXS, the open exchange format of gearbox models (FVA): reading files into cases and back.

document: components, attributes and relations as they stand in a file; reading: .rexs, .rexsj and
.rexsz; assembly: what turns together; stages, gears, supports, loads: the keys of a case with the
place each comes from; to_case: the commented case; from_case, writing: a case as a file.
"""
