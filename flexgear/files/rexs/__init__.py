"""Import and export of REXS, the open exchange format of gearbox models (FVA).

Import: reading parses .rexs, .rexsj and .rexsz; document holds components, attributes and
relations; assembly finds the bodies (components that rotate together); stages, stage_keys, gears,
flanks, supports, shafts and ports derive the keys of a case and their sources; to_case
combines them. Export: from_case, stage_out, outgoing. tables: units, fields and modifications for
both directions.
"""
