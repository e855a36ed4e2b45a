"""The ring of wind-5mw on FE meshes of several sizes: same section, more layers; or finer."""

from dataclasses import replace
from functools import cache

import numpy as np

from flexgear.model.load import load_case
from flexgear.model.stage_view import StageView
from flexgear.structures.fe_mesh.fe_mesh import FeMesh
from flexgear.structures.fe_mesh.gears import ring_fe_mesh
from flexgear.structures.fem.assembly import FeModel
from flexgear.structures.fem.ties import Interface
from flexgear.structures.reduction import Reduction
from flexgear.structures.sources.reducing import tied
from flexgear.structures.sources.ring import source as ring_source

# name -> fidelity of the section, number of bands that cut the middle of the face into layers
SIZES = {
    "37k": ("quick", 0),
    "57k": ("quick", 3),
    "133k": ("standard", 0),
    "314k": ("fine", 0),
    "1M": ("fine", 18),
}


def ring_case(fidelity: str = "quick") -> StageView:
    """wind-5mw with FE meshes of the given fidelity."""
    return load_case("wind-5mw", {"solver.fidelity": fidelity}).view()


def ring_fe_mesh_of_size(size: str) -> tuple[StageView, FeMesh]:
    """Case and FE mesh of a size in `SIZES`."""
    fidelity, bands = SIZES[size]
    case = ring_case(fidelity)
    p = ring_source(case).parameters
    lows = sorted(p.fits)
    edges = np.linspace(lows[0][1], lows[-1][0], bands + 1)
    cuts = tuple(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)) if bands else ()
    return case, ring_fe_mesh(replace(p, fits=(*lows, *cuts)))


@cache
def ring_model(size: str) -> tuple[StageView, FeModel, Interface]:
    """Case, assembled FE model and all 120 interface nodes."""
    case, fe_mesh = ring_fe_mesh_of_size(size)
    model = assembled(case, fe_mesh)
    return case, model, tied(model, ring_source(case).nodes(model.fe_mesh))


def small_ring() -> FeModel:
    """A ring of half the teeth and bolts, for peers that take long; patches as usual."""
    case = ring_case()
    p = replace(ring_source(case).parameters, teeth=47, bolts=13, bolt_circle_diameter=1.13)
    return assembled(case, ring_fe_mesh(p))


def assembled(case: StageView, fe_mesh: FeMesh) -> FeModel:
    """A body with its matrices, before anything is timed."""
    m = case.material
    model = FeModel(fe_mesh, m.young_modulus, m.poisson_ratio, m.density)
    _ = model.mass
    return model


def fixed_frequencies(reduction: Reduction) -> np.ndarray:
    """Frequencies of the fixed-interface modes of a reduced body, Hz."""
    body = reduction.body
    return np.sqrt(np.diag(body.stiffness)[len(body.stiffness) - body.n_modes :]) / (2 * np.pi)


def dofs_text(dofs: int) -> str:
    """37386 -> "37 386 dofs"."""
    return f"{dofs:,} dofs".replace(",", "\u2009")
