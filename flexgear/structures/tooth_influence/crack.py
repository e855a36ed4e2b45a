"""What a crack at the root adds to the compliance of a tooth's flank.

    ΔC_ij = b_i^T (F_cracked − F_whole) b_j ,   F = R^T K^{-1} R  (``influence``)

of one segment with and without the crack (``fe_mesh.cracked_segment``): positive semidefinite, as
a crack takes connections away, smooth (the dip under the load is in both), and independent of how
deep the rim is held once that is some modules. It is added to what the tooth has, whatever model
that comes from. The crack is open under all loads of the flank on its side, stays as it is, and its
faces carry nothing; teeth beside it are not moved by it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.slices import Slices
from flexgear.model.faults import Fault
from flexgear.model.stage_view import StageView
from flexgear.structures.cache import cached_arrays
from flexgear.structures.fe_mesh.cracked_segment import CrackedSegmentParameters, cracked_segment
from flexgear.structures.fe_mesh.tooth_segment import SegmentDivisions
from flexgear.structures.fem.assembly import FeModel, SolidMesh
from flexgear.structures.fem.sampling import facet_nodes
from flexgear.structures.tooth_influence.influence import (
    FlankCompliance,
    flank_nodes,
    held_flexibility,
    unit_loads,
)
from flexgear.structures.tooth_influence.of_case import (
    DEEPEST,
    MARGIN,
    held_radius,
    one_tooth,
    require_teeth,
)
from flexgear.structures.tooth_influence.pairs import mating_flanks, rows_at, some_places, widths

WITHIN_LAYER = 9  # places over which the depth of a layer is averaged
PLACES = 151  # contact lines that are computed; linear between
DIVISIONS = SegmentDivisions(flank=6, fillet=7, rim=5)  # ``tooth`` follows from the crack


def crack_flexibility(view: StageView, path: GearMeshPath, lines: Slices, fault: Fault) -> Array:
    """ΔC (S, K, K) m/N between slices of contact lines, by a crack of one of both teeth, from the
    cache or made (half a minute)."""
    role = "planet" if fault.gear == view.part("planet") else path.kind.gear
    mating = next(m for m in mating_flanks(path, lines) if m.name == role)
    # z of the flank as it is made: turned and mirrored ones, and left halves, count the other way
    flipped = (mating.sense < 0) ^ mating.other_hand ^ (path.side == "left")
    p, material = crack_parameters(view, role, fault, -1.0 if flipped else 1.0), view.material
    if max(p.depths) == 0.0:
        return np.zeros((*lines.z.shape, lines.count))
    young, poisson = material.young_modulus, material.poisson_ratio
    content = {"cracked": p, "young": young, "poisson": poisson}
    added = cached_arrays(FlankCompliance, 1, content, lambda: added_compliance(p, young, poisson))
    some, width = some_places(lines, PLACES), widths(path, lines)
    flank = mating.of(added)
    flexibility = flank.matrix(mating.roll[some], lines.z[some], width[some])
    return rows_at(lines.s[some], flexibility, lines.s)


def crack_parameters(
    view: StageView, role: str, fault: Fault, sense: float
) -> CrackedSegmentParameters:
    """Segment of a gear with a crack; sense: +1 where z of the segment counts as in the case."""
    tooth = stage_geometry(view).gears[role]
    require_teeth(view, role, tooth, "take the crack out")
    one = one_tooth(view, role, tooth)
    divisions = replace(DIVISIONS, layers=one.divisions.layers)
    borders = one.layer_positions
    share = (np.arange(WITHIN_LAYER) + 0.5) / WITHIN_LAYER
    depths = fault.depth_at(sense * (borders[:-1, None] + np.diff(borders)[:, None] * share))
    return CrackedSegmentParameters(
        tooth=tooth,
        face_width=one.face_width,
        helix_rate=one.helix_rate,
        held_radius=held_radius(view, role, tooth, DEEPEST),
        flank_layer=one.flank_layer,
        teeth=1,  # those beside it change what a crack adds by less than 1 %
        divisions=divisions,
        margin=MARGIN,
        angle=fault.angle,
        depths=tuple(depths.mean(axis=1).tolist()),
    )


def added_compliance(
    p: CrackedSegmentParameters, young: float, poisson: float, *, plane_strain: bool = False
) -> FlankCompliance:
    """F_cracked − F_whole of the −θ flank of the middle tooth, zero without depth; E in Pa;
    plane_strain: as in ``influence_of``."""
    segment = cracked_segment(p)
    whole, held = segment.whole, {"held": segment.whole.fe_mesh.facets["held"]}
    flexibility = []
    for fe_mesh in (whole.fe_mesh, SolidMesh(segment.points, segment.cells, "hex", held)):
        model = FeModel(fe_mesh, young, poisson, density=1.0)
        free = np.ones((len(model.nodes), 3), dtype=bool)
        free[facet_nodes(model, fe_mesh.facets["held"])] = False
        free[:, 2] &= not plane_strain
        loads = unit_loads(whole, model, flank_nodes(whole, model, p.middle))
        flexibility.append(held_flexibility(model, free, loads))
    added = flexibility[1] - flexibility[0]
    return FlankCompliance(
        roll=whole.roll,
        z=whole.z,
        slope=p.roll_slope,
        compliance=0.5 * (added + added.T),
    )
