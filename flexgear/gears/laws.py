"""Stiffness law of a tooth pair that a stage asks for, and the mean of its gear mesh.

Per-pair models have the shape of their law; a mean that is given scales it. Waves (constant,
rectangular, fourier) have pairs of one stiffness per length of contact line, k' = k̄/(ε_α b), whose
sum has the mean k̄: the one that the case gives, else c_γ b of ISO 6336-1.

What the ring's FE mesh holds is not counted again: of a law k' the share σ(ξ) of the compliance
(Weber and Banaschek's split) that is in the FE mesh is taken out, k'/(1 − σ). With the tie "flank"
σ is the ring's tooth and its foundation; with "root" it is the foundation (the rim below the
tooth), which is taken out of the law "weber-banaschek" only: ISO's c' and tables stay as they are.

``force`` is the normal force (N) of one gear mesh of "sun" or "ring" at rated load. Only
Weber–Banaschek's split depends on it, by the logarithm of Hertz's contact.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from flexgear.gears.geometry import PER_PAIR_MODELS, StageGeometry, given_stiffness
from flexgear.gears.radii import gears_by_role
from flexgear.gears.stiffness import Law, iso_single_stiffness, parabola, table_law
from flexgear.gears.waves import iso_mean_stiffness
from flexgear.gears.weber_banaschek import PairCompliance, Side, pair_compliance

if TYPE_CHECKING:
    from flexgear.model.stage_view import StageView


def iso_peak(view: StageView, role: str) -> float:
    """c' of ISO 6336-1 with "sun" or "ring", N/m² along the 3D normal."""
    stage, gears = view.stage, gears_by_role(view.stage)
    # index 1 of ISO is the pinion, the smaller of two external gears
    first, second = gears["planet"], gears[role]
    if role != "ring" and second.teeth < first.teeth:
        first, second = second, first
    return iso_single_stiffness(
        teeth=(first.teeth, second.teeth),
        internal=role == "ring",
        shifts=(first.profile_shift, 0.0 if role == "ring" else second.profile_shift),
        dedendum=0.5 * (first.dedendum + second.dedendum),
        pressure_angle=stage.pressure_angle,
        helix_angle=stage.helix_angle,
        young_modulus=view.material.young_modulus,
    )


def line_load(view: StageView, g: StageGeometry, role: str, force: float) -> float:
    """w = |F| cosβ_b/(ε_α b), N/m: the gear-mesh force over the mean length of contact."""
    length = g.gear_meshes[role].transverse_contact_ratio * view.stage.face_width
    return abs(force) * math.cos(g.base_helix_angle) / length


def compliance(view: StageView, g: StageGeometry, role: str, force: float) -> PairCompliance:
    """Weber–Banaschek split of the planet with "ring" or "sun". InputError without load."""
    if force == 0:
        raise view.refuse(
            "gear_mesh.pair_stiffness",
            f"weber-banaschek needs a load, but no torque passes the gear mesh ({role})",
            "load the train, or use iso6336",
        )
    return pair_compliance(
        g.planet,
        g.gears[role],
        g.gear_meshes[role],
        young=view.material.young_modulus,
        poisson=view.material.poisson_ratio,
        line_load=line_load(view, g, role, force),
    )


def pair_law(view: StageView, g: StageGeometry, role: str, force: float) -> Law:
    """k'(ξ) of the planet with "ring" or "sun", N/m² along the 3D normal, without what FE bodies of
    the two hold."""
    law = _whole_law(view, g, role, force)
    split_law = view.gear_mesh.pair_stiffness == "weber-banaschek"
    sides: tuple[tuple[Side, str], ...] = (("planet", "planet"), ("gear", role))
    with_root = split_law and view.gear_mesh.model in PER_PAIR_MODELS
    taken = [
        (side, tie)
        for side, name in sides
        if (tie := view.fe_tie(name)) == "flank" or (tie and with_root)
    ]
    if not taken:
        return law
    split = compliance(view, g, role, force)
    held = sum(split.share(side, tie) for side, tie in taken)
    return table_law(split.xi, law(split.xi) / (1.0 - held))


def mean_stiffness(view: StageView, g: StageGeometry, role: str, force: float) -> float:
    """Mean of one gear mesh (of one half, if double-helical), N/m along the 3D normal."""
    return law_mean(pair_law(view, g, role, force), view, g, role)


def law_mean(law: Law, view: StageView, g: StageGeometry, role: str) -> float:
    """Mean over a base pitch of all pairs together, ε_α b ∫ k'(ξ) dξ, N/m."""
    xi = np.linspace(0.0, 1.0, 2001)
    values = law(xi)
    mean = float(np.sum(0.5 * (values[1:] + values[:-1]))) / (len(xi) - 1)
    return g.gear_meshes[role].transverse_contact_ratio * view.stage.face_width * mean


def _whole_law(view: StageView, g: StageGeometry, role: str, force: float) -> Law:
    """k'(ξ) with all that both teeth and their foundations give."""
    stiffness = given_stiffness(view, role)
    if view.gear_mesh.model not in PER_PAIR_MODELS:
        ratio, width = g.gear_meshes[role].transverse_contact_ratio, view.stage.face_width
        mean = (
            iso_mean_stiffness(iso_peak(view, role), ratio, width)
            if stiffness is None
            else stiffness
        )
        return lambda xi: np.full_like(xi, mean / (ratio * width))
    law = _shape(view, g, role, force)
    if stiffness is None:
        return law
    scale = stiffness / law_mean(law, view, g, role)
    return lambda xi: scale * law(xi)


def _shape(view: StageView, g: StageGeometry, role: str, force: float) -> Law:
    options = view.gear_mesh
    if options.pair_stiffness == "weber-banaschek":
        split = compliance(view, g, role, force)
        cos_bb = math.cos(g.base_helix_angle)
        return table_law(split.xi, 1.0 / (split.total * cos_bb**2))
    if options.pair_stiffness == "table":
        assert options.table is not None  # the model refuses a table law without tables
        table = getattr(options.table, role)
        return table_law(np.asarray(table.position), np.asarray(table.stiffness))
    return parabola(iso_peak(view, role), options.end_ratio)
