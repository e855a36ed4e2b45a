"""Loaded gear pair: compliance of both bodies, contact at a place of the path, what comes of it."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from flexgear.arrays import Array
from plane_contact import active_set
from plane_contact.body import Body, Elastic
from plane_contact.rolling import Candidates, Pair, Relief, Rolling
from plane_contact.sector import LOADED, Grid, Sector, sector


@dataclass(frozen=True)
class ContactResult:
    """At one place: transmission error (the planet's lag on its base circle, m), pair loads
    (loaded teeth,) N/m along the line of action, half widths of the touching zones (m), and largest
    tension along the fillets below the touching flanks (2, loaded teeth) Pa
    of planet and gear, each at the planet's tooth number."""

    error: float
    loads: Array
    half_widths: Array
    root_stress: Array


class GearContact:
    """Two held sectors with the compliance of their flanks."""

    def __init__(self, pair: Pair, material: Elastic, module: float, grid: Grid):
        self.pair = pair
        self.sectors = (
            sector(pair.planet, 1, module, grid),
            sector(pair.gear, pair.gear_side, module, grid),
        )
        self.bodies = tuple(_body(s, material) for s in self.sectors)

    def at(self, s: float, load: float, rolling: Rolling, stress: bool = True) -> ContactResult:
        """With the middle teeth at s; load: N per m of face along the line of action."""
        c = rolling.candidates(s)
        maps = [forces_on(c, b, body) for b, body in enumerate(self.bodies)]
        compliance = sum(
            m.T @ (body.compliance @ m) for m, body in zip(maps, self.bodies, strict=True)
        )
        compliance = 0.5 * (compliance + compliance.T)
        base = self.pair.planet.base_radius
        p, turn = active_set.solve(c.gap, compliance, c.lever[:, None], np.array([load * base]))
        loads = np.array([p[c.pair == k].sum() for k in range(len(LOADED))])
        widths = np.array(
            [half_width(c.arc, np.where(c.pair == k, p, 0.0)) for k in range(len(LOADED))]
        )
        return ContactResult(
            float(turn[0]) * base,
            loads,
            widths,
            self._root_stress(maps, p) if stress else np.zeros(0),
        )

    def rolling(self, relief: tuple[Relief, Relief], window: float, path_only: bool) -> Rolling:
        """Candidates with flanks relieved so."""
        return Rolling(self.pair, self.sectors, relief, window, path_only)

    def _root_stress(self, maps: list[sp.csr_matrix], p: Array) -> Array:
        out = np.zeros((2, len(LOADED)))
        for b, (body, part) in enumerate(zip(self.bodies, self.sectors, strict=True)):
            u = body.displacement((maps[b] @ p).reshape(body.dofs.shape))
            for k, j in enumerate(LOADED):
                tooth = LOADED.index(j if b == 0 else self.pair.mate_step * j)
                out[b, k] = body.edge_stress(u, part.fillets[tooth])[0].max()
        return out


def _body(part: Sector, material: Elastic) -> Body:
    body = Body.held_at_facets(part.fe_mesh, material, part.held)
    body.of_chains(part.vertices, part.facets)
    return body


def half_width(place: Array, p: Array) -> float:
    """Half width a of Hertz's pressure with the second moment a²/4 of forces p at places, m."""
    total = p.sum()
    if total <= 0.0:
        return 0.0
    middle = place @ p / total
    return float(2.0 * np.sqrt((place - middle) ** 2 @ p / total))


def forces_on(c: Candidates, b: int, body: Body) -> sp.csr_matrix:
    """Forces on the body's chain dofs by unit forces of the candidates, (dofs, n)."""
    n = len(c.gap)
    rows = 2 * c.nodes[b][:, :, None] + np.arange(2)
    values = c.weights[b][:, :, None] * c.force[b][:, None, :]
    columns = np.broadcast_to(np.arange(n)[:, None, None], rows.shape)
    return sp.csr_matrix(
        (values.ravel(), (rows.ravel(), columns.ravel())), shape=(body.dofs.size, n)
    )
