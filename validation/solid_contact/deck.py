"""CalculiX's deck of a planet's tooth pressed on a ring's, and what comes out of it.

The ring's segment is held still, the planet's is held at a rigid body that comes nearer along the
line of action n by w₀ and is tilted by w₁ about e_z × n at the contact line, so that a point of the
line moves by n (w₀ + w₁ z). Small displacements, no friction, face to face with a stiff linear
penalty; of each point of contact p CalculiX prints the overlap d_p and the energy E_p, so that its
force is 2 E_p/d_p. Both flanks are whole surfaces: with one for each slice (CalculiX 2.20) half of
the points are lost, and an even load comes out uneven by 2 %.
"""

import io
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from plane_contact.body import Elastic
from plane_contact.rolling import Pair
from plane_contact.sector import Grid

from flexgear.arrays import Array
from flexgear.structures.fe_mesh.fe_mesh import HEX_FROM_VTK, FeMesh
from flexgear.structures.fe_mesh.inp import write_inp
from solid_contact.segment import extruded, section, walls

TABLES = ("relative contact displacement", "contact print energy")


@dataclass(frozen=True)
class Solid:
    """What is meshed. s: path coordinate of the contact line, m; face_width m; slices: whose forces
    are asked; layers: of elements in a slice; grid: of the section, whose sizes are halved;
    penalty: pressure per overlap over Young's modulus, 1/m."""

    s: float
    face_width: float
    slices: int
    layers: int
    grid: Grid
    penalty: float

    @property
    def borders(self) -> Array:
        """Of the layers, m."""
        return np.linspace(-0.5, 0.5, self.slices * self.layers + 1) * self.face_width


@dataclass(frozen=True)
class Motion:
    """Of the planet's body: w₀ m and w₁."""

    approach: float
    tilt: float


def both_bodies(pair: Pair, module: float, solid: Solid) -> FeMesh:
    """Planet, then ring, each layer by layer, in the pair's frame; patches planet_flank,
    planet_held, ring_flank, ring_held."""
    z = solid.borders
    points, cells, facets, first = [], [], {}, 0
    sides = (1, pair.gear_side)
    for name, tooth, side, place in zip(
        ("planet", "ring"), (pair.planet, pair.gear), sides, pair.places(solid.s), strict=True
    ):
        plane = section(tooth, side, module, solid.grid)
        vertices, hexes = extruded(plane, z)
        turned = place.centre + vertices[:, :2] @ np.array([1, 1j]) * np.exp(1j * place.angle)
        points.append(np.column_stack([turned.real, turned.imag, vertices[:, 2]]))
        cells.append(hexes + first)
        for patch, edges in (("held", plane.held), ("flank", plane.flank)):
            facets[f"{name}_{patch}"] = walls(plane, edges, len(z) - 1) + first
        first += len(vertices)
    hexes = np.concatenate(cells)
    return FeMesh(np.concatenate(points), hexes[:, HEX_FROM_VTK], "hex", facets)


def normal_of(pair: Pair) -> Array:
    """n (3,), along which the planet presses on the ring."""
    return np.array([np.sin(pair.working), np.cos(pair.working), 0.0])


def displacement(pair: Pair, s: float, motion: Motion, points: Array) -> Array:
    """Of points (k, 3) of the planet's body, (k, 3) m."""
    n, turn = normal_of(pair), np.exp(-1j * pair.working)
    line = (pair.planet.base_radius + 1j * s) * turn
    beside = points - np.array([line.real, line.imag, 0.0])
    along = n * (motion.approach + motion.tilt * beside[:, 2:])
    return np.asarray(along - motion.tilt * np.outer(beside @ n, [0, 0, 1]))


def write_deck(
    path: Path, fe_mesh: FeMesh, pair: Pair, solid: Solid, material: Elastic, motion: Motion
) -> None:
    """Hexahedra with incompatible modes (C3D8I), one static step."""
    stream = io.StringIO()
    write_inp(fe_mesh, stream)
    held = np.unique(fe_mesh.facets["planet_held"])
    moved = displacement(pair, solid.s, motion, fe_mesh.points[held])
    rows = [
        f"{node + 1}, {i + 1}, {i + 1}, {value:.12e}\n"
        for node, row in zip(held, moved, strict=True)
        for i, value in enumerate(row)
    ]
    text = [
        stream.getvalue().replace("TYPE=C3D8,", "TYPE=C3D8I,"),
        f"*MATERIAL, NAME=STEEL\n*ELASTIC\n{material.young!r}, {material.poisson!r}\n",
        "*SOLID SECTION, ELSET=EALL, MATERIAL=STEEL\n",
        "*SURFACE INTERACTION, NAME=STIFF\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n",
        f"{solid.penalty * material.young:.6e}\n",
        "*CONTACT PAIR, INTERACTION=STIFF, TYPE=SURFACE TO SURFACE\nplanet_flank, ring_flank\n",
        "*BOUNDARY\nN_ring_held, 1, 3\n*STEP\n*STATIC\n1., 1.\n*BOUNDARY\n",
        *rows,
        "*CONTACT PRINT\nCDIS, CELS\n",
        "*NODE PRINT, NSET=N_planet_held, TOTALS=ONLY\nRF\n*END STEP\n",
    ]
    path.write_text("".join(text), encoding="utf-8")


def run(program: str, deck: Path) -> str:
    """What CalculiX prints to its .dat file; ArithmeticError where it fails."""
    done = subprocess.run(
        [program, deck.stem],
        cwd=deck.parent,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    if "Job finished" not in done.stdout:
        raise ArithmeticError(f"CalculiX failed: {done.stdout[-500:]}")
    return deck.with_suffix(".dat").read_text()


def slice_forces(printed: str, fe_mesh: FeMesh, solid: Solid) -> Array:
    """(K,) N along the normals of the flank, from what CalculiX printed."""
    overlap, energy = (_table(printed, name) for name in TABLES)
    if not np.array_equal(overlap[:, :2], energy[:, :2]):
        raise ArithmeticError("CalculiX printed overlaps and energies of different points")
    z = fe_mesh.points[fe_mesh.vtk_cells[energy[:, 0].astype(np.int64) - 1], 2].mean(axis=1)
    number = np.floor((z / solid.face_width + 0.5) * solid.slices).astype(np.int64)
    return np.bincount(number, 2 * energy[:, 2] / -overlap[:, 2], minlength=solid.slices)


def reaction(printed: str, pair: Pair) -> float:
    """Force that the planet's body needs along n, N."""
    place = printed.index("total force")
    return float(_table(printed[place:], "total force")[0] @ normal_of(pair))


def _table(printed: str, name: str) -> Array:
    """Rows of numbers below a title."""
    lines = iter(printed[printed.index(name) :].splitlines()[2:])
    rows = []
    for line in lines:
        if not line.strip():
            break
        rows.append([float(word) for word in line.split()])
    return np.array(rows)
