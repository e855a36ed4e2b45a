"""Modified flanks: the gap that a pair of teeth has at every place of its path of contact.

A modification is a function of what a case gives for a flank (``FlankModifications``) and of that
``Flank``, and returns gap(rho, z) -> m, the material that is missing normal to the flank in the
transverse section at the radius of curvature rho of the flank (its distance from the base tangent
point on the line of action) and at z along the face, both of any shapes that broadcast; None where
the flank has none. To add one: write its file, enter it in ``MODIFICATIONS``, and give
``FlankModifications`` its key. Modifications of a flank add up.

A pair is one spring δ along its line of action. With the stiffness k' per width that it has there,

    F = ∫ k' (δ − g) dz = k (δ − ḡ),   ḡ(s) = ∫ k' g dz / k,

g = (g_gear + g_planet) cosβ_b being the gap along the 3D normal: the mean gap over the contact
line, exact while all of it touches. It is taken over ``slices`` of the line, at which a pair under
face_load feels the gap itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from flexgear.gears.modifications.crowning import lead_crowning, profile_crowning
from flexgear.gears.modifications.flank import Array, Flank, Gap
from flexgear.gears.modifications.relief import end_relief, root_relief, tip_relief
from flexgear.gears.modifications.slopes import helix_slope, profile_slope, twist
from flexgear.gears.modifications.table import table
from flexgear.gears.slices import Slices
from flexgear.model.modifications import FlankModifications

__all__ = ["MODIFICATIONS", "Flank", "Gap", "PairGap", "gaps_of", "mean_gap", "pair_gap"]

MODIFICATIONS: tuple[Callable[[FlankModifications, Flank], Gap | None], ...] = (
    profile_crowning,
    profile_slope,
    lead_crowning,
    helix_slope,
    twist,
    tip_relief,
    root_relief,
    end_relief,
    table,
)


def gaps_of(given: FlankModifications, flank: Flank) -> list[Gap]:
    """All modifications of one flank of a gear."""
    found = [made(given, flank) for made in MODIFICATIONS]
    return [gap for gap in found if gap is not None]


PairGap = Callable[[Array, Array], Array]


def pair_gap(gaps: list[tuple[Gap, Callable[[Array], Array]]], slope: float) -> PairGap:
    """g(s, z) m of a pair along the 3D normal, at its path coordinate s there and z along the face
    (any shape); gaps: of each flank, with its rho as a function of the path coordinate; slope:
    ds/dz of a contact line."""
    cos_b = math.cos(math.atan(slope))

    def gap(s: Array, z: Array) -> Array:
        total = np.zeros(np.broadcast_shapes(np.shape(s), np.shape(z)))
        for of_flank, rho in gaps:
            total += of_flank(rho(s), z)
        return total * cos_b

    return gap


def mean_gap(slices: Slices) -> Array:
    """ḡ (S,) m of contact lines in slices, 0 where they hold nothing."""
    total = slices.stiffness.sum(axis=1)
    weighted = (slices.stiffness * slices.gap).sum(axis=1)
    return np.divide(weighted, total, out=np.zeros_like(total), where=total > 0)
