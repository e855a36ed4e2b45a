"""How the patches of a body's loaded nodes answer, from its condensation: see `patch_shapes.py`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.structures.fem import FeModel, facet_sample
from flexgear.structures.patch_shapes import Orders, PatchShapes, patch_rows, without_rigid
from flexgear.structures.reduction import AnyCondensation, Reduction
from flexgear.structures.tooth_shapes import ToothLine

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class LoadedPatch:
    """The patch of a loaded node. rows: B_s (s, 3v) on the dofs (3v,) that it sees."""

    node: str
    dofs: Ints = field(repr=False)
    rows: Array = field(repr=False)


def loaded_patches(
    model: FeModel, lines: Mapping[str, ToothLine], groups: Sequence[str], orders: Orders
) -> list[LoadedPatch]:
    """Of nodes "…_number" by name, on their lines.

    groups: stems of the surfaces that a node loads; those that the FE mesh has are taken together;
    orders: of their shapes.
    """
    known, numbers = model.fe_mesh.facets, [name.partition("_")[2] for name in lines]
    there = [stem for stem in groups if f"{stem}_{numbers[0]}" in known]
    facets = [np.concatenate([known[f"{stem}_{n}"] for stem in there]) for n in numbers]
    sample = facet_sample(model, np.concatenate(facets))
    points = len(sample.weights) // sum(map(len, facets))  # of a facet
    ends = points * np.cumsum([0, *map(len, facets)])
    out = []
    for (node, line), begin, end in zip(lines.items(), ends, ends[1:], strict=False):
        rows = patch_rows(line, sample.points[begin:end], sample.weights[begin:end], orders)
        own = sample.interpolation[begin:end]
        nodes, local = np.unique(own.indices, return_inverse=True)
        compact = sp.csr_matrix((own.data, local, own.indptr), (end - begin, len(nodes)))
        on_nodes = np.stack([compact.T @ rows[:, :, i].T for i in range(3)], axis=1)
        dofs = (3 * nodes[:, None] + np.arange(3)).ravel().astype(np.int64)
        out.append(LoadedPatch(node, dofs, np.ascontiguousarray(on_nodes.reshape(len(dofs), -1).T)))
    return out


def nodes_beside(model: FeModel, patches: Sequence[LoadedPatch]) -> Ints:
    """Nodes (n,) beside the vertices that patches see."""
    nodes = np.unique(np.concatenate([patch.dofs[::3] // 3 for patch in patches]))
    return nodes[nodes >= model.vertex_dofs // 3]


def shapes_of(reduction: Reduction, patches: Sequence[LoadedPatch]) -> PatchShapes:
    """Of all loaded nodes of a body, which follow each other among its interface nodes."""
    condensation = reduction.condensation
    interface = condensation.interface
    place = np.full(condensation.recovered.max() + 1, -1)
    place[condensation.recovered] = np.arange(len(condensation.recovered))
    motion = []
    for patch in patches:
        at = 3 * place[patch.dofs // 3] + patch.dofs % 3
        motion.append(patch.rows @ reduction.constraint_modes[at])
    form = shape_loads(condensation, patches[0])
    flexibility = form.T @ condensation.fixed_solve(form)
    return PatchShapes(
        interface.node_names.index(patches[0].node),
        without_rigid(np.array(motion), interface.positions),
        0.5 * (flexibility + flexibility.T),
    )


def shape_loads(condensation: AnyCondensation, patch: LoadedPatch) -> Array:
    """B_s^T as fields (d, s)."""
    forces = np.zeros((condensation.mesh_dofs, len(patch.rows)))
    forces[patch.dofs] = patch.rows.T
    return condensation.load_field(forces)
