"""Root stress of a plane tooth by other means than flexgear's: teeth cut by brute force
(``cut_teeth``), triangles of gmsh, scikit-fem; of flexgear only the sparse Cholesky factor."""

from functools import lru_cache

import numpy as np
from cut_teeth.gear import Gear
from plane_contact.body import Body, Elastic
from plane_contact.sector import Grid, flank_points, sector

GRID = Grid(flank=40, fillet=48, neighbours=1)
MIDDLE = 1  # of the three teeth that could be loaded


class PlaneTooth:
    """The middle one of five teeth, held so many modules below the root circle."""

    def __init__(self, gear: Gear, material: Elastic, held: float, grid: Grid = GRID) -> None:
        grid = Grid(**{**vars(grid), "held": held})
        self.gear, self.part = gear, sector(gear, 1, gear.module, grid)
        self.body = Body.held_at_facets(self.part.fe_mesh, material, self.part.held)
        middle = slice(MIDDLE, MIDDLE + 1)
        self.body.of_chains(self.part.vertices[middle], self.part.facets[middle])

    def roll(self, share: float) -> float:
        """Roll length (m) of the vertex nearest to a share of the flank's length from the root."""
        return float(np.sqrt(2 * self.gear.base_radius * self.part.arc[self._vertex(share)]))

    def stress(self, share: float) -> float:
        """Largest tension along the root below a unit line load (N/m) there, Pa m/N."""
        vertex = self._vertex(share)
        radius, half = flank_points(self.gear, self.part.arc[vertex])
        alpha = np.arccos(self.gear.base_radius / radius)
        inward = -(self.gear.outward * np.sin(alpha) + 1j * np.cos(alpha)) * np.exp(1j * half)
        force = np.zeros(self.body.dofs.shape)
        force[0, 2 * vertex] = inward.real, inward.imag
        u = self.body.displacement(force)
        return float(self.body.edge_stress(u, self.part.fillets[MIDDLE])[0].max())

    def _vertex(self, share: float) -> int:
        return round((1.0 - share) * (len(self.part.arc) - 1))


@lru_cache(maxsize=16)
def plane_tooth(gear: Gear, material: Elastic, held: float) -> PlaneTooth:
    """Kept for several loads."""
    return PlaneTooth(gear, material, held)
