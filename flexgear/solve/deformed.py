"""Displacement fields of finite-element bodies in equilibrium."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexgear.analysis.equilibrium import revolution
from flexgear.analysis.recovery import Recovery
from flexgear.model.errors import InputError
from flexgear.model.read import nearest
from flexgear.results.fields import field_dataset
from flexgear.solve.model import Model, rated_rotations


def bending_bodies(model: Model) -> list[str]:
    """Finite-element bodies that bend: "stage.ring", "stage.carrier"; those with an FE mesh."""
    names = [
        f"{stage}.{part}"
        for stage, own in model.bodies.items()
        for part, body in own.by_part.items()
        if len(body.points)  # a body that was given reduced has none
    ]
    return [name for name in names if not model.system.body(name).rigid]


def deformed(
    model: Model, body: str, carrier_angle: float = 0.0, torque: float | None = None
) -> xr.Dataset:
    """Displacement (p, 3) m of every vertex of a body's FE mesh in equilibrium, rolling taken off.

    body: one of ``bending_bodies``; carrier_angle: rotation of the lead, rad; torque: N m on the
    first input, rated unless given. u = Φ_r q with the recovery Φ_r of the reduction.
    """
    known = bending_bodies(model)
    if body not in known:
        raise InputError("deformed", body, "is no body that bends", nearest(body, known))
    stage, _, part = body.partition(".")
    reduced = model.bodies[stage].by_part[part]
    system = model.system
    given = system.rated_torque if torque is None else torque
    found = revolution(model.modal, rated_rotations(system, np.array([carrier_angle])), given)
    return field_dataset(
        body,
        reduced.points,
        reduced.cells,
        reduced.recover(Recovery(found).coordinates(body, 0)),
        carrier_angle=carrier_angle,
        input_torque=float(given),
    )
