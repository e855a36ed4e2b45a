"""REXS, the open exchange format of gearbox models (FVA): reading files into cases and back.

document: components, attributes and relations as they stand in a file; reading: .rexs, .rexsj and
.rexsz; assembly: what turns together; stages, stage_keys, gears, flanks, supports, shafts, joints,
ports (and load cases): the keys of a case with the place each comes from; to_case: the commented
case; from_case, stage_out, outgoing: a case as a file; tables: units, fields and modifications that
both ways walk.
"""
