"""How the slices of a pair's contact lines bend each other, from the influence of both teeth."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import interp1d

from flexgear.gears.contact import GearMeshPath
from flexgear.gears.hertz import ContactBody, line_contact, relative_radius
from flexgear.gears.slices import Slices
from flexgear.gears.tooth import ToothGeometry
from flexgear.gears.weber_banaschek import middle_depth
from flexgear.model.stage_view import StageView
from flexgear.structures.tooth_influence.of_case import tooth_influence

Array = NDArray[np.float64]

_PLACES = 251  # contact lines for which the flexibility is computed; linear between
_LEAST_WIDTH = 1e-6  # of the face, where a line has left it


def pair_bending(
    case: StageView, path: GearMeshPath, slices: Slices
) -> tuple[Array, tuple[Array, Array]]:
    """Flexibility (S, K, K) m/N of both teeth between the slices of every contact line, and a
    (m/N), d (N) of the approach a f ln(d/f) of their line contact, (S, K) each.

    For ``gears.slices.bent``. Displacement and force are along the normal N. Off the path of
    contact the line contact is that of the flanks at the tip; a sharp edge is softer.
    """
    slot = path.kind.removesuffix("_back")
    width = np.maximum(slices.width, _LEAST_WIDTH * 2 * path.half_face)
    on = np.clip(slices.s[:, None] + path.slope * slices.z, *slices.span)
    rolls = path.off_path.rolls(on)
    teeth = (path.off_path.planet, path.off_path.gear)
    internal = path.off_path.gear.internal
    slopes = (path.slope, path.slope if internal else -path.slope)
    some = np.unique(np.linspace(0, len(on) - 1, _PLACES).astype(np.int64))
    flexibility, bodies, radii = np.zeros((len(some), *2 * on.shape[1:])), [], []
    for name, tooth, roll, slope in zip(("planet", slot), teeth, rolls, slopes, strict=True):
        low, high = sorted(map(tooth.roll_length, (tooth.form_radius, tooth.tip_radius)))
        roll = np.clip(np.nan_to_num(roll, nan=high), max(low, 1e-3 * tooth.base_pitch), high)
        radii.append(roll)
        influence = tooth_influence(case, name)
        if influence is None:
            bodies.append(_to_middle(case, tooth, roll))
            continue
        same = influence.slope * slope >= 0  # else the other flank, or the other hand
        flank = influence if same else influence.turned()
        flexibility += flank.matrix(roll[some], slices.z[some], width[some])
        bodies.append(flank.contact_body(roll))
    cos = path.cos_base_helix
    radius = relative_radius(radii[0], radii[1], internal=internal) / cos
    contact = line_contact(bodies[0], bodies[1], radius)
    between = interp1d(slices.s[some], flexibility, axis=0, copy=False, assume_sorted=True)
    return between(slices.s), contact.of_slice(width / cos)


def _to_middle(case: StageView, tooth: ToothGeometry, roll: Array) -> ContactBody:
    """The flank of a tooth that an FE body has whole: line contact down to its middle line."""
    depth = middle_depth(tooth, np.hypot(tooth.base_radius, roll))
    return ContactBody(case.material.young_modulus, case.material.poisson_ratio, depth)
