"""FE influence of a tooth: what a line load on a flank moves along that flank and the next one."""
