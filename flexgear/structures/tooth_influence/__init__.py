"""FE influence of a tooth: what a line load on a flank moves along that flank and the next one."""

from flexgear.structures.tooth_influence.influence import ToothInfluence
from flexgear.structures.tooth_influence.of_case import tooth_influence
from flexgear.structures.tooth_influence.pairs import pair_bending

__all__ = ["ToothInfluence", "pair_bending", "tooth_influence"]
