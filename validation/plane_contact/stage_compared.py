"""The plane stage of stage.json beside flexgear's equilibria of the same case."""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import flexgear as fg
from flexgear.arrays import Array
from flexgear.model.load import load_case
from flexgear.solve.model import assemble
from flexgear.solve.static import static

FOLDER = Path(__file__).parent
FILE, CASE = FOLDER / "stage.json", FOLDER / "stage_case.toml"
KINDS = ("ring", "sun")  # in the order of stage.json
SAME_PLACE = 0.1  # base pitches


@dataclass(frozen=True)
class Stage:
    """forces (angles, 2, N) and loads (angles, 2, N, 3) N/m of gear meshes and their pairs; orders
    (angles, n) m of the radial displacement of the ring's teeth."""

    forces: Array
    loads: Array
    orders: Array


@cache
def reference(ring: str) -> dict[str, Array]:
    """The FE contact with a ring "in plane strain" or "in plane stress"."""
    data: dict[str, Any] = json.loads(FILE.read_text("utf-8"))[f"ring {ring}"]
    return {name: np.array(values) for name, values in data.items()}


def computed(ring: str) -> Stage:
    """FE contact."""
    by_fe = reference(ring)
    return Stage(by_fe["forces"], by_fe["loads"], np.abs(fg.radial_harmonics(by_fe["ring"])))


def flexgear_stage(fidelity: str, compliance: str = "width") -> Stage:
    """Equilibria at the same angles, pairs in the order of the reference's places; compliance: of
    the teeth, "fe" takes minutes the first time."""
    by_fe = reference("in plane strain")
    keys = {"solver.fidelity": fidelity, "stage.gear_mesh.tooth_compliance": compliance}
    keys |= {"stage.ring.fe.fixed_interface_modes": "8", "solver.reduction_limit_hz": "100"}
    case = load_case(CASE, keys)
    face, planets = case.view().stage.face_width, by_fe["forces"].shape[2]
    result = static(assemble(case), by_fe["angles"])
    forces, loads = np.zeros_like(by_fe["forces"]), np.zeros_like(by_fe["loads"])
    pitch = np.diff(by_fe["places"], axis=-1).mean()
    for row, kind in enumerate(KINDS):
        for i in range(planets):
            name = f"stage {kind} {i + 1}"
            forces[:, row, i] = result.gear_mesh_force.sel(gear_mesh=name) / face
            flank = result.sel(flank=f"{name} drive")
            place, load = flank.pair_position.to_numpy(), flank.pair_load.to_numpy() / face
            far = np.abs(place[:, None, :] - by_fe["places"][:, row, i, :, None])
            touch = (load[:, None, :] > 0) & (far < SAME_PLACE * pitch)
            loads[:, row, i] = np.where(touch, load[:, None, :], 0.0).sum(axis=2)
    displacement = result.tooth_displacement.to_numpy()[..., :2]
    return Stage(forces, loads, np.abs(fg.radial_harmonics(displacement)))
