"""FE influence of a tooth: what a line load on a flank moves along that flank and the next one."""

from flexgear.structures.tooth_influence.influence import ToothInfluence
from flexgear.structures.tooth_influence.of_case import tooth_influence
from flexgear.structures.tooth_influence.pairs import pair_bending
from flexgear.structures.tooth_influence.rim import rim_bending
from flexgear.structures.tooth_influence.roots import (
    PairRoots,
    pair_roots,
    require_influences,
    ring_root_rows,
    root_of_case,
)

__all__ = [
    "PairRoots",
    "ToothInfluence",
    "pair_bending",
    "pair_roots",
    "require_influences",
    "rim_bending",
    "ring_root_rows",
    "root_of_case",
    "tooth_influence",
]
