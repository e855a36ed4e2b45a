"""Gradients of FE fields at the vertices of their mesh, from the elements' own functions."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from flexgear.structures.fem.assembly import FeModel


def element_gradient(model: FeModel, vertices: NDArray[np.int64]) -> sp.csr_matrix:
    """D (3k, n): rows 3i + j give ∂f/∂x_j at vertex i of nodal values f (n,), the mean over the
    elements that meet there of the derivative of their functions."""
    cells, basis = model.basis.mesh.t, model.basis
    place = np.full(len(model.nodes), -1)
    place[vertices] = np.arange(len(vertices))
    rows, columns, values = [], [], []
    for corner, at in enumerate(place[cells]):
        inside = np.flatnonzero(at >= 0)
        local = basis.elem.refdom.p[:, [corner]]
        inverse = basis.mapping.invDF(local, inside)[..., 0]  # (reference, x, cell)
        for a, nodes in enumerate(basis.element_dofs[:, inside]):
            slope = np.asarray(basis.elem.lbasis(local, a)[1])[:, 0]
            rows.append((3 * at[inside] + np.arange(3)[:, None]).ravel())
            columns.append(np.broadcast_to(nodes, (3, len(inside))).ravel())
            values.append(np.einsum("ijc,i->jc", inverse, slope).ravel())
    table = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    total = sp.csr_matrix(table, shape=(3 * len(vertices), len(model.nodes)))
    count = np.bincount(place[cells].ravel() + 1, minlength=len(vertices) + 1)[1:]
    return (sp.diags_array(np.repeat(1.0 / count, 3)) @ total).tocsr()
