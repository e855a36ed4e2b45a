"""Stiffness of the gear meshes of a train's lumped stage: mean, and law of a single pair.

The mean is what the case gives, else c_γ b of ISO 6336-1. Waves (constant, rectangular, fourier)
have pairs of one stiffness per length of contact line, k' = k̄/(ε_α b), whose sum has the mean k̄.
Per-pair models keep the shape of their law; a mean that is given scales it. No FE mesh holds the
teeth of a lumped stage, so that nothing is taken out of a law.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from flexgear.gears.laws import iso_pair_peak
from flexgear.gears.messages import stage_key
from flexgear.gears.power_flow import power_flow
from flexgear.gears.stiffness import Law, parabola, table_law
from flexgear.gears.train_geometry import PER_PAIR_MODELS, TrainGeometry, external_pair
from flexgear.gears.waves import iso_mean_stiffness
from flexgear.gears.weber_banaschek import PairCompliance, pair_compliance
from flexgear.model.errors import InputError

if TYPE_CHECKING:
    from flexgear.model.case import Case
    from flexgear.model.train_stage import TrainStage


def given_stiffness(stage: TrainStage, slot: str) -> float | None:
    """Mean stiffness that the case gives for "sun" or "ring", N/m along N."""
    options = stage.gear_mesh
    return options.sun_stiffness if slot == "sun" else options.ring_stiffness


def iso_peak_of(train: Case, stage: TrainStage, slot: str) -> float:
    """c' of ISO 6336-1 with "sun" or "ring", N/m² along the 3D normal."""
    pair = external_pair(stage) if stage.kind == "parallel" else stage.stage
    return iso_pair_peak(pair, slot, train.material.young_modulus)


def mean_stiffness(train: Case, stage: TrainStage, g: TrainGeometry, slot: str) -> float:
    """Mean of one gear mesh (of one half, if double-helical), N/m along the 3D normal."""
    given = given_stiffness(stage, slot)
    if given is not None:
        return given
    if stage.gear_mesh.model in PER_PAIR_MODELS:
        return law_mean(_shape(train, stage, g, slot), g, slot, stage.face_width)
    ratio = g.gear_meshes[slot].transverse_contact_ratio
    return iso_mean_stiffness(iso_peak_of(train, stage, slot), ratio, stage.face_width)


def law_mean(law: Law, g: TrainGeometry, slot: str, face_width: float) -> float:
    """Mean over a base pitch of all pairs together, ε_α b ∫ k'(ξ) dξ, N/m."""
    xi = np.linspace(0.0, 1.0, 2001)
    values = law(xi)
    mean = float(np.sum(0.5 * (values[1:] + values[:-1]))) / (len(xi) - 1)
    return g.gear_meshes[slot].transverse_contact_ratio * face_width * mean


def train_pair_law(train: Case, stage: TrainStage, g: TrainGeometry, slot: str) -> Law:
    """k'(ξ) of a pair with "sun" or "ring", N/m² along the 3D normal."""
    if stage.gear_mesh.model not in PER_PAIR_MODELS:
        length = g.gear_meshes[slot].transverse_contact_ratio * stage.face_width
        mean = mean_stiffness(train, stage, g, slot)
        return lambda xi: np.full_like(xi, mean / length)
    law, given = _shape(train, stage, g, slot), given_stiffness(stage, slot)
    if given is None:
        return law
    scale = given / law_mean(law, g, slot, stage.face_width)
    return lambda xi: scale * law(xi)


def _shape(train: Case, stage: TrainStage, g: TrainGeometry, slot: str) -> Law:
    options = stage.gear_mesh
    if options.pair_stiffness == "weber-banaschek":
        split = pair_compliance_of(train, stage, g, slot)
        cos_bb = math.cos(g.radii.base_helix_angle)
        return table_law(split.xi, 1.0 / (split.total * cos_bb**2))
    if options.pair_stiffness == "table":
        assert options.table is not None  # the model refuses a table law without tables
        table = getattr(options.table, slot)
        return table_law(np.asarray(table.position), np.asarray(table.stiffness))
    return parabola(iso_peak_of(train, stage, slot), options.end_ratio)


def pair_compliance_of(
    train: Case, stage: TrainStage, g: TrainGeometry, slot: str
) -> PairCompliance:
    """Weber–Banaschek split at the line load F cosβ_b/(ε_α b) of the train's steady flow.

    Raises InputError where the train puts no load on the gear mesh.
    """
    flow = power_flow(train).stage(stage.name)
    force = abs(flow.sun_gear_mesh_force if slot == "sun" else flow.ring_gear_mesh_force)
    if force == 0:
        raise InputError(
            train.source, stage_key(stage, "gear_mesh.pair_stiffness"),
            f"weber-banaschek needs a load, but no torque passes the gear mesh ({slot})",
            "load the train, or use iso6336",
        )  # fmt: skip
    gear_mesh, cos_bb = g.gear_meshes[slot], math.cos(g.radii.base_helix_angle)
    return pair_compliance(
        g.gears["planet"],
        g.gears[slot],
        gear_mesh,
        young=train.material.young_modulus,
        poisson=train.material.poisson_ratio,
        line_load=force * cos_bb / (gear_mesh.transverse_contact_ratio * stage.face_width),
    )
