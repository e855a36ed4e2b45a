"""How the slices of a gear mesh bend each other: influence of both teeth, and line contact.

The flexibility between slices is the sum of both flanks' by FE (``structures.tooth_influence``);
line contact on the layer that those leave out is added with the radius of relative curvature of
every place. Drive and coast flanks of a tooth follow from each other by half a turn about its
radial axis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.contact import GearMeshPath
from flexgear.gears.hertz import ContactBody, LineContact, line_contact, relative_radius
from flexgear.gears.slices import Slices, bent
from flexgear.gears.tooth import ToothGeometry
from flexgear.model.material import Material
from flexgear.structures.tooth_influence import ToothInfluence

Array = NDArray[np.float64]
PLACES = 61  # contact lines of a path between which flexibility is interpolated
LEAST = 1e-3  # of the longest contact line: shorter ones carry next to nothing


def with_bending(
    path: GearMeshPath,
    teeth: Mapping[str, ToothInfluence | None],
    material: Material,
    line_load: float,
) -> GearMeshPath:
    """The path with slices that bend each other.

    teeth: influence of "planet" and "gear" on their −θ flanks, None of a tooth that an FE body
    holds whole; line_load: N/m of contact line at which nominal stiffness is taken.
    """
    slices = path.slices
    assert slices is not None
    length = slices.width.sum(axis=1)
    at = np.linspace(0, len(slices.s) - 1, PLACES).round().astype(int)
    at = at[length[at] > LEAST * length.max()]
    flanks = {name: _flank(path, name, tooth) for name, tooth in teeth.items()}
    flexibility = np.stack([_flexibility(path, slices, flanks, i) for i in at])
    whole = _interpolated(slices.s[at], flexibility, slices.s)
    # of a line that is hardly there: as of the shortest that is looked at
    pieces = np.maximum(slices.width, LEAST * length.max() / slices.count) / path.cos_base_helix
    contact = _contact(path, slices, flanks, material)
    scale = contact.beta / pieces
    limit = pieces * np.exp(contact.alpha / contact.beta)
    load = line_load * pieces.sum(axis=1)
    return replace(path, slices=bent(slices, whole, (scale, limit), load))


def _flank(path: GearMeshPath, name: str, tooth: ToothInfluence | None) -> ToothInfluence | None:
    """The flank that works: where the force on the planet points against its rotation about the
    carrier, −θ of sun and ring, of the planet −θ at the sun and +θ at the ring."""
    if tooth is None:
        return None
    forward = path.normal_xy[1] < 0
    minus = forward if name == "gear" or path.kind.startswith("sun") else not forward
    return tooth if minus else tooth.turned()


def _rolls(path: GearMeshPath, s: Array) -> dict[str, tuple[Array, float]]:
    """Roll lengths on both flanks at path coordinates, and which way they go with them."""
    planet, gear = path.off_path.rolls(s)
    return {"planet": (planet, 1.0), "gear": (gear, 1.0 if path.kind.startswith("ring") else -1.0)}


def _flexibility(
    path: GearMeshPath, slices: Slices, flanks: Mapping[str, ToothInfluence | None], i: int
) -> Array:
    """(K, K) m/N of both flanks at one contact line."""
    total = np.zeros((slices.count, slices.count))
    z, width = slices.z[i], slices.width[i]
    for name, (roll, way) in _rolls(path, slices.s[i] + path.slope * z).items():
        flank = flanks[name]
        if flank is not None:
            total += flank.matrix(roll, z, width, way * path.slope)
    return total


def _contact(
    path: GearMeshPath,
    slices: Slices,
    flanks: Mapping[str, ToothInfluence | None],
    material: Material,
) -> LineContact:
    """Line contact of every slice (S, K)."""
    rolls = _rolls(path, slices.s[:, None] + path.slope * slices.z)
    bodies: list[ContactBody] = []
    planet, gear = rolls["planet"][0], rolls["gear"][0]
    geometry = {"planet": path.off_path.planet, "gear": path.off_path.gear}
    for name, (roll, _) in rolls.items():
        flank = flanks[name]
        if flank is not None:
            body = flank.contact_body(roll.ravel())
            bodies.append(replace(body, depth=np.asarray(body.depth).reshape(roll.shape)))
        else:
            depth = _half_thickness(geometry[name], roll)
            bodies.append(ContactBody(material.young_modulus, material.poisson_ratio, depth))
    internal = path.kind.startswith("ring")
    least = 1e-3 * path.base_pitch  # a flank that begins at its base circle has no curvature there
    radius = relative_radius(np.maximum(planet, least), np.maximum(gear, least), internal=internal)
    return line_contact(bodies[0], bodies[1], radius / path.cos_base_helix)


def _half_thickness(tooth: ToothGeometry, roll: Array) -> Array:
    """Half the tooth's thickness at a roll length, m: as deep as Weber and Banaschek look."""
    radius = np.hypot(tooth.base_radius, roll)
    angle = tooth.half_angle(radius)
    return np.asarray(radius * np.sin(angle))


def _interpolated(known: Array, matrices: Array, places: Array) -> Array:
    """(S, K, K) between matrices (P, K, K) at rising places (P,), and theirs beyond the ends."""
    y = np.clip(np.interp(places, known, np.arange(len(known))), 0, len(known) - 1)
    j = np.minimum(y.astype(int), len(known) - 2)
    w = (y - j)[:, None, None]
    return np.asarray((1.0 - w) * matrices[j] + w * matrices[j + 1])
