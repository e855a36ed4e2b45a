"""The same gear pairs by flexgear: equilibria of case.toml with one planet, so that sun and ring
carry what the torque asks, at the angles at which their pairs stand at given places.

Transmission error is the approach of the bodies along the line of action at the middle of the face.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from flexgear.arrays import Array
from flexgear.gears.paths import stage_paths
from flexgear.model.load import load_case
from flexgear.solve.model import assemble
from flexgear.solve.static import static
from plane_contact import stored
from plane_contact.cases import CASE, RELIEF_MM, RELIEF_UM, Loading

COMPLIANCES = {"width": "Weber and Banaschek, pairs per width", "fe": "FE influence of the teeth"}


@dataclass(frozen=True)
class Loaded:
    """Transmission error (places,) m and pair loads (places, 3) N per m of face."""

    error: Array
    loads: Array


@cache
def loaded(kind: str, loading: Loading, compliance: str = "width", step: int = 1) -> Loaded:
    """At every so many of the stored places of the middle pair; kind: "sun" or "ring"; compliance:
    one of ``COMPLIANCES``, of which "fe" takes minutes the first time."""
    case = load_case(CASE)
    planets, torque = case.view().stage.planets, case.inputs[0].torque
    keys = {
        "stage.planets": "1",
        "inputs.0.torque_nm": str(loading.share * torque / planets),
        "stage.gear_mesh.tooth_compliance": compliance,
        "stage.gear_mesh.path_only": str(loading.path_only).lower(),
    }
    for name in ("planet", kind) if loading.relieved else ():
        relief = f"stage.{name}.modifications.tip_relief"
        keys |= {f"{relief}.amount_um": str(RELIEF_UM), f"{relief}.length_mm": str(RELIEF_MM)}
    case = load_case(CASE, keys)
    path = stage_paths(case.view(), dict.fromkeys(("sun", "ring"), 1.0))[kind, ""]
    angles = (stored.places(kind)[::step] - path.position(0, 0, 0.0)) / path.rate
    data = static(assemble(case), angles)
    flank = f"stage {kind} 1 drive"
    slots = data.sizes["slot"]
    loads = data.pair_load.sel(flank=flank).to_numpy() / case.view().stage.face_width
    inner = loads[:, np.arange(-1, 2) % slots]  # pair 0 stands at s
    return Loaded(data.transmission_error.sel(flank=flank).to_numpy(), inner)
