"""How gear meshes are modelled, and damping of the structure."""

from __future__ import annotations

import itertools
from typing import Literal

from pydantic import Field, model_validator

from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Rate, Stiffness, StiffnessPerWidth, Time


class StiffnessTable(Section):
    """Stiffness of a tooth pair per face width, along the 3D normal, over the path of contact.

    position: share of the path of contact from 0 (smallest distance to the planet's base tangent
    point, the planet's root) to 1 (the planet's tip), rising. stiffness: at these positions.
    """

    position: tuple[float, ...] = Field(min_length=2)
    stiffness: tuple[StiffnessPerWidth, ...] = Field(min_length=2)

    @model_validator(mode="after")
    def _rising(self) -> StiffnessTable:
        p = self.position
        if len(p) != len(self.stiffness):
            raise Refusal(
                "stiffness", f"{len(self.stiffness)} values at {len(p)} positions", "match them"
            )
        if any(b <= a for a, b in itertools.pairwise(p)) or p[0] < 0 or p[-1] > 1:
            raise Refusal("position", "does not rise from 0 to 1", "put it in order")
        if min(self.stiffness) <= 0 or max(self.stiffness) > 1e12:
            raise Refusal("stiffness", "is not plausible", "about 10 to 25 N/(mm µm)")
        return self


class GearMeshTables(Section):
    """Tables of both gear meshes, for pair_stiffness = "table".

    ring, sun: of the planets' pairs with the ring, with the sun.
    """

    ring: StiffnessTable
    sun: StiffnessTable


class GearMesh(Section):
    """Gear-mesh options.

    table: of both gear meshes, for pair_stiffness = "table". slices: of a contact line under
    face_load. tooth_compliance: of them: width, springs beside each other by pair_stiffness; fe,
    they bend each other by an FE influence matrix of both teeth (half a minute a gear, kept), with
    Hertz's line contact. root_stress: under face_load, stress of all tooth roots; fe, by an FE
    submodel of three teeth of each gear (about a minute a gear, kept). path_only: under face_load
    tips do not touch before and after the path of contact. harmonics: terms of a fourier wave.

    model: per_pair, one spring for every tooth pair; face_load, its contact line cut into slices,
    for load along the face; lumped, one element at the pitch point, of all pairs together;
    constant, the mean stiffness there; rectangular, a wave between the two numbers of pairs in
    contact; fourier, that wave's first ``harmonics`` terms. ring_stiffness,
    sun_stiffness: mean, N/m along the 3D normal, of one gear mesh (of each half of a double-helical
    stage); if left out from the pairs' law, for waves c_γ b of ISO 6336-1. A parallel stage uses
    sun_*. ring_contact_ratio, sun_contact_ratio: of the waves; from the geometry if left out.
    contact_law: one-sided, with backlash and coast flanks; linear, pairs on the path also pull.
    pair_stiffness: iso6336, parabola with the peak c'; weber-banaschek, deflection of the real
    profiles; table. end_ratio: value of the parabola at the ends of the path over its peak.
    damping_ratio: of each pair against the gears' equivalent mass. A stage of lumped members has
    constant stiffness and linear contact where it does not say, one-sided with face_load.
    """

    model: Literal["per_pair", "face_load", "lumped", "constant", "rectangular", "fourier"] = (
        "per_pair"
    )
    slices: int = Field(default=15, ge=1, le=101)
    path_only: bool = False
    tooth_compliance: Literal["width", "fe"] = "width"
    root_stress: Literal["none", "fe"] = "none"
    contact_law: Literal["one-sided", "linear"] = "one-sided"
    pair_stiffness: Literal["iso6336", "weber-banaschek", "table"] = "iso6336"
    end_ratio: float = Field(default=0.67, ge=0.05, le=1.0)
    table: GearMeshTables | None = None
    damping_ratio: float = Field(default=0.07, ge=0.0, le=1.0)
    ring_stiffness: Stiffness | None = Field(default=None, gt=0.0, le=1e13)
    sun_stiffness: Stiffness | None = Field(default=None, gt=0.0, le=1e13)
    harmonics: int = Field(default=5, ge=1, le=100)
    ring_contact_ratio: float | None = Field(default=None, ge=1.0, le=20.0)
    sun_contact_ratio: float | None = Field(default=None, ge=1.0, le=20.0)

    @model_validator(mode="after")
    def _complete(self) -> GearMesh:
        if self.pair_stiffness == "table" and self.table is None:
            raise Missing(
                "table", "is missing", "give [gear_mesh.table.ring] and [gear_mesh.table.sun]"
            )
        if self.model == "face_load" and self.contact_law == "linear":
            raise Refusal(
                "contact_law",
                "'linear' lets flanks pull, which slices along the face do not",
                'use "one-sided" with face_load',
            )
        if self.root_stress == "fe" and self.model != "face_load":
            raise Refusal(
                "root_stress",
                f"'fe' needs the load along the face, which model = '{self.model}' does not give",
                'use model = "face_load" with it, or take it out',
            )
        return self


class Damping(Section):
    """Structural damping: modal ratio of the coupled system, or C = α M + β K.

    kind: one of the two. ratio: of every mode to critical damping. alpha, beta: of mass and of
    stiffness in Rayleigh damping.
    """

    kind: Literal["modal", "rayleigh"] = "modal"
    ratio: float = Field(default=0.02, ge=0.0, le=1.0)
    alpha: Rate = Field(default=0.0, ge=0.0, le=1e4)
    beta: Time = Field(default=0.0, ge=0.0, le=1.0)
