"""Sun shaft of Timoshenko beam elements along z.

Element stiffness: Euler–Bernoulli beam with shear parameter Φ = 12 E I / (κ G A l²)
(Przemieniecki 1968, eqs. 5.116); the consistent mass integrates ρA N_wᵀN_w + ρI N_θᵀN_θ with the
static Timoshenko shape functions of the same Φ (Friedman, Kosmatka 1993, Comput. Struct. 47:473),
so that it includes rotary inertia and shear.
Shear coefficient κ of a hollow circle after Cowper (1966).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexgear.arrays import Array
from flexgear.model.names import BodyName
from flexgear.structures.bodies import Body, node_motions


@dataclass(frozen=True)
class BeamSection:
    """One hollow circular section: length, outer and inner diameter, m."""

    length: float
    outer_diameter: float
    inner_diameter: float = 0.0

    @property
    def area(self) -> float:
        """Cross-section, m²."""
        return math.pi / 4 * (self.outer_diameter**2 - self.inner_diameter**2)

    @property
    def second_moment(self) -> float:
        """Second moment of area about a diameter, m⁴."""
        return math.pi / 64 * (self.outer_diameter**4 - self.inner_diameter**4)

    def shear_coefficient(self, poisson_ratio: float) -> float:
        """Cowper's κ of a hollow circle, m = d_i/d_o."""
        nu, m2 = poisson_ratio, (self.inner_diameter / self.outer_diameter) ** 2
        return 6 * (1 + nu) * (1 + m2) ** 2 / ((7 + 6 * nu) * (1 + m2) ** 2 + (20 + 12 * nu) * m2)


def _bending_shapes(x: float, length: float, phi: float) -> tuple[Array, Array]:
    """Deflection and rotation shapes (4,) at x for dofs (w1, θ1, w2, θ2), w' = θ without shear."""
    r, d = x / length, 1.0 / (1.0 + phi)
    w = d * np.array(
        [
            2 * r**3 - 3 * r**2 - phi * r + 1 + phi,
            length * (r**3 - (2 + phi / 2) * r**2 + (1 + phi / 2) * r),
            -2 * r**3 + 3 * r**2 + phi * r,
            length * (r**3 - (1 - phi / 2) * r**2 - phi / 2 * r),
        ]
    )
    th = d * np.array(
        [
            6 / length * (r**2 - r),
            3 * r**2 - (4 + phi) * r + 1 + phi,
            -6 / length * (r**2 - r),
            3 * r**2 - (2 - phi) * r,
        ]
    )
    return w, th


def beam_element(
    section: BeamSection, length: float, young: float, poisson: float, density: float
) -> tuple[Array, Array]:
    """Stiffness and consistent mass (12, 12) of a beam along +z; dofs of two nodes in turn."""
    area, inertia = section.area, section.second_moment
    shear = young / (2 * (1 + poisson))
    phi = 12 * young * inertia / (section.shear_coefficient(poisson) * shear * area * length**2)
    b = young * inertia / (length**3 * (1 + phi))
    kb = b * np.array(
        [
            [12, 6 * length, -12, 6 * length],
            [6 * length, (4 + phi) * length**2, -6 * length, (2 - phi) * length**2],
            [-12, -6 * length, 12, -6 * length],
            [6 * length, (2 - phi) * length**2, -6 * length, (4 + phi) * length**2],
        ]
    )
    mb = np.zeros((4, 4))
    points, weights = np.polynomial.legendre.leggauss(5)
    for p, g in zip(points, weights, strict=True):
        w, th = _bending_shapes((p + 1) * length / 2, length, phi)
        mb += g * length / 2 * density * (area * np.outer(w, w) + inertia * np.outer(th, th))
    stiffness, mass = np.zeros((12, 12)), np.zeros((12, 12))
    # x–z plane: θ = +ry; y–z plane: dv/dz = −rx
    for dofs, sign in (([0, 4, 6, 10], 1.0), ([1, 3, 7, 9], -1.0)):
        s = np.array([1.0, sign, 1.0, sign])
        stiffness[np.ix_(dofs, dofs)] += kb * np.outer(s, s)
        mass[np.ix_(dofs, dofs)] += mb * np.outer(s, s)
    bar, rod = np.array([[1.0, -1.0], [-1.0, 1.0]]), np.array([[2.0, 1.0], [1.0, 2.0]]) / 6
    for dofs, ka, ma in (
        ([2, 8], young * area / length, density * area * length),
        ([5, 11], shear * 2 * inertia / length, density * 2 * inertia * length),
    ):
        stiffness[np.ix_(dofs, dofs)] += ka * bar
        mass[np.ix_(dofs, dofs)] += ma * rod
    return stiffness, mass


def shaft_body(
    sections: Sequence[BeamSection],
    *,
    young: float,
    poisson: float,
    density: float,
    direction: float,
    elements_per_section: int = 2,
    end_masses: dict[str, Array] | None = None,
) -> Body:
    """Beam from the sun gear (node "sun" at z = 0) to its far end (node "end").

    young: Pa; density: kg/m³; direction: +1 or −1, the sense of z in which the shaft leaves the
    gear. Nodes between are "shaft_1", "shaft_2" … ``end_masses`` adds a 6 × 6 mass to a named node,
    as that of the gear.
    """
    parts = [section for section in sections for _ in range(elements_per_section)]
    lengths = [section.length / elements_per_section for section in parts]
    n = len(parts) + 1
    mass, stiffness = np.zeros((6 * n, 6 * n)), np.zeros((6 * n, 6 * n))
    order = np.roll(np.arange(12), 6 if direction < 0 else 0)  # elements run along +z
    for e, (section, length) in enumerate(zip(parts, lengths, strict=True)):
        k, m = beam_element(section, length, young, poisson, density)
        at = np.ix_(6 * e + order, 6 * e + order)
        stiffness[at] += k
        mass[at] += m
    names = ("sun", *(f"shaft_{i}" for i in range(1, n - 1)), "end")
    for name, extra in (end_masses or {}).items():
        i = 6 * names.index(name)
        mass[i : i + 6, i : i + 6] += extra
    positions = np.zeros((n, 3))
    positions[1:, 2] = np.sign(direction) * np.cumsum(lengths)
    motions = node_motions(positions, 6 * n)
    return Body(BodyName.of("", "shaft"), names, positions, mass, stiffness, np.eye(6 * n), motions)
