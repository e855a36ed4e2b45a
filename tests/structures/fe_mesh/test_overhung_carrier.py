"""A carrier of one wall, whose bearing seats are both on the drive side, from an FE mesh file."""

from pathlib import Path

import gmsh
import numpy as np
import pytest
from small_train import SMALL_STAGE

import flexgear as fg

SEATS = {"bearing_drive": (-58.0, -46.0), "bearing_far": (-40.0, -28.0)}  # z, mm
PIN_RADIUS, PIN_CIRCLE = 6.0, 37.5  # the centre distance of 28 and 22 teeth of module 1.5, mm
FORCE = 1000.0  # N


def overhung_carrier(path: Path) -> None:
    """A disc with four cantilever pins and a hub, meshed by gmsh; its surfaces are named."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 0)
    occ = gmsh.model.occ
    disc = occ.addCylinder(0, 0, -28, 0, 0, 12, 49)
    solids = [occ.addCylinder(0, 0, -62, 0, 0, 34, 25)]
    centres = [PIN_CIRCLE * np.exp(0.5j * np.pi * k) for k in range(4)]
    solids += [occ.addCylinder(c.real, c.imag, -16, 0, 0, 28, PIN_RADIUS) for c in centres]
    body, _ = occ.fuse([(3, disc)], [(3, solid) for solid in solids])
    body, _ = occ.cut(body, [(3, occ.addCylinder(0, 0, -70, 0, 0, 60, 13))])
    cuts = [occ.addDisk(0, 0, z, 40, 40) for z in (-58, -46, -40)]
    cuts += [occ.addDisk(c.real, c.imag, z, 8, 8) for c in centres for z in (-10, 10)]
    occ.fragment(body, [(2, cut) for cut in cuts])
    occ.synchronize()
    solids = gmsh.model.getEntities(3)
    walls = [s for _, s in gmsh.model.getBoundary(solids, oriented=False)]
    gmsh.model.addPhysicalGroup(3, [solid for _, solid in solids], name="body")
    for wall in walls:
        low, high = np.reshape(gmsh.model.getBoundingBox(2, wall), (2, 3))
        width, centre = high[0] - low[0], (low + high) / 2
        bands = {n: np.allclose((low[2], high[2]), z, atol=1e-3) for n, z in SEATS.items()}
        name = next((n for n, fits in bands.items() if fits and width > 45), "")
        if high[2] < -61.9:
            name = "drive"
        elif np.allclose((low[2], high[2]), (-10, 10), atol=1e-3):
            name = f"pin_{round(np.angle(complex(*centre[:2])) / (np.pi / 2)) % 4 + 1}"
        if name:
            gmsh.model.addPhysicalGroup(2, [wall], name=name)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 8)
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 12)
    gmsh.model.mesh.generate(3)
    gmsh.write(str(path))
    gmsh.finalize()


@pytest.fixture(scope="module")
def carrier(tmp_path_factory: pytest.TempPathFactory):
    """Reduced body of the mesh in the small stage."""
    path = tmp_path_factory.mktemp("overhung") / "carrier.msh"
    overhung_carrier(path)
    keys = {"fe_mesh": "file", "fe_mesh_file": str(path), "fixed_interface_modes": 10}
    case = fg.load_case(SMALL_STAGE, {f"stage.carrier.fe.{key}": v for key, v in keys.items()})
    return case.assemble(rigid=("ring", "shaft")).bodies["stage.carrier"]


def test_seats_of_an_overhung_carrier_share_a_lateral_load_as_levers_do(carrier) -> None:
    """On two radial springs alone the forces of the seats follow from statics: R_2 = F l_1/(l_1 −
    l_2) and R_1 = −F l_2/(l_1 − l_2), l being the distances of the seats from the pins' load."""
    stiffness, radial = carrier.stiffness.copy(), 1e8
    held = {"drive": [5], "bearing_drive": [0, 1, 2], "bearing_far": [0, 1]}
    for node, dofs in held.items():
        at = carrier.node_slice(node).start + np.array(dofs)
        stiffness[at, at] += radial
    load = np.zeros(len(stiffness))
    for k in range(1, 5):
        load[carrier.node_slice(f"pin_{k}").start + 1] = FORCE / 4
    motion = np.linalg.solve(stiffness, load)
    forces = [radial * motion[carrier.node_slice(seat).start + 1] for seat in SEATS]
    first, second = (-np.mean(band) for band in SEATS.values())
    by_levers = FORCE * np.array([-second, first]) / (first - second)
    np.testing.assert_allclose(forces, by_levers, rtol=1e-4)
