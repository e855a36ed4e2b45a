"""Building blocks for other models: geometry, contact paths, pair stiffness, FE reduction."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexgear.gears.contact import GearMeshPath
from flexgear.gears.geometry import StageGeometry, stage_geometry
from flexgear.gears.paths import stage_paths
from flexgear.gears.power_flow import power_flow
from flexgear.model.case import Case
from flexgear.model.errors import InputError, echo
from flexgear.model.read import nearest
from flexgear.structures.fem.assembly import FeModel, facet_sample, solid_fe_mesh
from flexgear.structures.fem.ties import averaging_tie, interface_of
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.reduction import reduce

if TYPE_CHECKING:
    from flexgear.structures.fem.assembly import Mesh


def geometry(case: Case, stage: str = "") -> StageGeometry:
    """Teeth, diameters, working angles, contact ratios and backlash of a stage, in SI.

    stage: name of the stage; not needed in a case with one stage. InputError for gears that do not
    mesh.
    """
    return stage_geometry(case.view(stage))


def contact_paths(case: Case, stage: str = "") -> dict[str, GearMeshPath]:
    """Paths of contact of a stage by gear mesh and flank: "ring", "ring_coast", "sun", "sun_coast",
    with the prefix "left " or "right " in a double-helical stage.

    A path has the positions of tooth pairs at a carrier angle (``position``), the range of path
    coordinates in which they touch (``touching``) and their stiffness (``pair_stiffness``) under
    the rated load of the power flow.
    """
    view = case.view(stage)
    paths = stage_paths(view, power_flow(case).stage(view.name).gear_mesh_forces)
    return {f"{side} {kind}".strip(): path for (kind, side), path in paths.items()}


def pair_stiffness(path: GearMeshPath, s: ArrayLike) -> NDArray[np.float64]:
    """Stiffness of a tooth pair along the normal of the flanks, N/m, at path coordinates s, m (any
    shape); zero beyond the path.

    It is the stiffness of ``gear_mesh.model = "per_pair"``. At the carrier angle θ the coordinate
    of pair k of planet i is ``path.position(i, k, θ)``.
    """
    return np.interp(np.asarray(s, dtype=float), path.s_grid, path.k_grid, left=0.0, right=0.0)


def reduce_fe_mesh(
    fe_mesh: Mesh,
    nodes: Mapping[str, ArrayLike | None],
    *,
    young_modulus: float,
    poisson_ratio: float,
    density: float,
    modes: int = 20,
) -> ReducedBody:
    """Craig–Bampton reduction of a solid body to n six-dof nodes at surface patches.

    fe_mesh: ``skfem.MeshHex`` or ``skfem.MeshTet`` in m; its elements are made quadratic. nodes:
    boundaries of the mesh by name, each with the position (3,) m of its node, None for the centre
    of the patch; a node has the mean motion of its patch. young_modulus Pa, density kg/m³; modes:
    number of fixed-interface modes. ``mass`` and ``stiffness`` (6 n + modes)² of the result begin
    with the nodes in the given order, (ux, uy, uz, rx, ry, rz) each; ``recover(q)`` gives the
    displacement of every vertex. InputError for an unknown boundary.
    """
    solid = solid_fe_mesh(fe_mesh)
    model = FeModel(solid, young_modulus, poisson_ratio, density)
    ties = []
    for name, position in nodes.items():
        if name not in solid.facets:
            remedy = nearest(name, list(solid.facets)) if solid.facets else "name its boundaries"
            raise InputError(
                "flexgear.reduce_fe_mesh(): nodes", echo(name), "is no boundary of the mesh", remedy
            )
        sample = facet_sample(model, solid.facets[name])
        centre = sample.weights @ sample.points / sample.weights.sum()
        at = centre if position is None else np.asarray(position, dtype=float)
        ties.append(averaging_tie(name, at, sample))
    return reduce(model, interface_of(model, ties), modes).body
