"""FE influence of a tooth: displacements along its flank and the next ones by line loads."""
