"""Data for the rating of gears: steel, surface and accuracy of each gear, rules of a case."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field

from flexgear.model.errors import echo
from flexgear.model.read import nearest
from flexgear.model.section import Missing, Refusal, Section
from flexgear.model.units import Length, Stress

if TYPE_CHECKING:
    from flexgear.model.case import Case

SteelKind = Literal[
    "case_hardened", "induction_hardened", "nitrided", "nitrided_through_hardening",
    "nitrocarburised", "through_hardened", "through_hardened_carbon",
]  # fmt: skip
RZ_OVER_RA = 6.0  # for gear flanks, in text books on ISO 6336-2


class GearRating(Section):
    """Data of one gear for its load capacity. If a required key is missing, flank or root is not
    rated.

    steel: case_hardened, induction_hardened (or by flame, flank and root), nitrided (nitriding
    steel), nitrided_through_hardening (through-hardening steel, gas nitrided), nitrocarburised,
    through_hardened (alloy steel) or through_hardened_carbon (plain carbon steel). grade: quality
    of material and heat treatment, ISO 6336-5. vickers_hardness: of the surface (HB is about 0.95
    HV). core_rockwell_hardness: HRC below a hardened case. flank_strength: allowable stress number
    σ_Hlim in place of that by steel, grade and hardness. root_strength: σ_Flim in place of that by
    steel, grade and hardness. yield_strength: σ_0.2, for the
    yield of roots under extreme loads, and for the notch sensitivity of a through-hardened gear.

    flank_rz, root_rz: mean peak-to-valley roughness R_z. flank_ra, root_ra: mean roughness R_a, in
    place of R_z = 6 R_a. accuracy_grade: of ISO 1328-1. pitch_deviation, profile_deviation,
    helix_deviation: single pitch deviation f_pt, profile form deviation f_fα, helix slope deviation
    f_Hβ in place of that of the grade. rim_factor: Y_B in place of that of the rim's thickness.
    mean_stress_ratio: M for roots loaded in both directions; if left out, that of ISO 6336-3,
    annex B: 0.8 - 0.15 Y_S case-hardened, 0.4 induction-hardened, else 0.3. face_width: of a gear
    that is wider than its gear mesh; up to one module of the excess at either end counts for the
    root. thickness_deviation: A_sn of the normal tooth thickness, negative for a thinner tooth; its
    root is cut with the generating profile shift x_E = x + A_sn/(2 m_n tan α_n).
    """

    steel: SteelKind | None = None
    grade: Literal["ML", "MQ", "ME"] | None = None
    vickers_hardness: float | None = Field(default=None, ge=100.0, le=1000.0)
    core_rockwell_hardness: float | None = Field(default=None, ge=10.0, le=60.0)
    flank_strength: Stress | None = Field(default=None, ge=5e7, le=3e9)
    root_strength: Stress | None = Field(default=None, ge=2e7, le=2e9)
    yield_strength: Stress | None = Field(default=None, ge=1e8, le=3e9)
    flank_rz: Length | None = Field(default=None, ge=5e-8, le=2e-4)
    flank_ra: Length | None = Field(default=None, ge=1e-8, le=5e-5)
    root_rz: Length | None = Field(default=None, ge=5e-8, le=2e-4)
    root_ra: Length | None = Field(default=None, ge=1e-8, le=5e-5)
    accuracy_grade: int | None = Field(default=None, ge=1, le=12)
    pitch_deviation: Length | None = Field(default=None, ge=0.0, le=1e-3)
    profile_deviation: Length | None = Field(default=None, ge=0.0, le=1e-3)
    helix_deviation: Length | None = Field(default=None, ge=0.0, le=1e-3)
    rim_factor: float | None = Field(default=None, ge=1.0, le=5.0)
    mean_stress_ratio: float | None = Field(default=None, ge=0.0, lt=1.0)
    face_width: Length | None = Field(default=None, ge=1e-4, le=5.0)
    thickness_deviation: Length = Field(default=0.0, ge=-5e-3, le=5e-3)

    @property
    def flank_roughness(self) -> float | None:
        """R_z of the flank, m."""
        return _roughness(self.flank_rz, self.flank_ra)

    @property
    def root_roughness(self) -> float | None:
        """R_z of the root, m."""
        return _roughness(self.root_rz, self.root_ra)

    def _check(self) -> None:
        self._keep_one("flank_ra", "flank_rz")
        self._keep_one("root_ra", "root_rz")
        if self.grade is not None and self.steel is None:
            raise Missing("steel", "is missing beside grade", "add steel, or take grade out")


def _roughness(rz: float | None, ra: float | None) -> float | None:
    return rz if ra is None else RZ_OVER_RA * ra


LIMITS = {
    "none": {
        "flank_safety": 1.0, "root_safety": 1.0, "dynamic_factor": 1.0, "face_load_factor": 1.0,
    },
    "wind": {
        "flank_safety": 1.25, "root_safety": 1.56, "dynamic_factor": 1.05, "face_load_factor": 1.15,
    },
}  # fmt: skip


class ForcedFactors(Section):
    """Prescribed load factors, in place of those of the model or the standard.

    application_factor: K_A of the teeth. k_gamma: mesh load factor K_γ of planets. k_v: dynamic
    factor. k_h_beta, k_f_beta: face load factors of flank and root. k_h_alpha, k_f_alpha:
    transverse load factors.
    """

    application_factor: float | None = Field(default=None, ge=0.1, le=10.0)
    k_gamma: float | None = Field(default=None, ge=1.0, le=10.0)
    k_v: float | None = Field(default=None, ge=1.0, le=10.0)
    k_h_beta: float | None = Field(default=None, ge=1.0, le=10.0)
    k_f_beta: float | None = Field(default=None, ge=1.0, le=10.0)
    k_h_alpha: float | None = Field(default=None, ge=1.0, le=10.0)
    k_f_alpha: float | None = Field(default=None, ge=1.0, le=10.0)


class GearMeshFactors(ForcedFactors):
    """Factors of some gear meshes, in place of those for all.

    stage: name of the stage, all stages if left out. kind: sun (also pinion and gear) or ring, both
    if left out.
    """

    stage: str | None = None
    kind: Literal["sun", "ring"] | None = None

    def applies(self, stage: str, kind: str) -> bool:
        """Whether these factors count for the gear meshes "sun" or "ring" of a stage."""
        return self.stage in (None, stage) and self.kind in (None, kind)


class RatedGearMesh(GearMeshFactors):
    """Factors and width of some gear meshes, in place of those for all.

    face_width: common face width in the formulas of ISO 6336, where those of a planet with sun and
    ring differ, in place of that of the stage.
    """

    face_width: Length | None = Field(default=None, ge=1e-4, le=5.0)


class Rating(ForcedFactors):
    """Rules by which the gears of a case are rated.

    edition: of ISO 6336: 2006 with deviations of ISO 1328-1:1995, or 2019 with those of 2013.
    application_factor: K_A of the teeth; 1 if the load spectrum includes all overloads. Bearings
    take their loads without it. limits: set of minimum safeties and factors: "none" has 1 for all;
    "wind" has S_H 1.25, S_F 1.56, K_v 1.05 and K_Hβ 1.15, as literature quotes IEC 61400-4:2012.
    least_flank_safety: S_Hmin in place of that of the set. least_root_safety: S_Fmin in place of
    that of the set. least_static_flank_safety, least_static_root_safety: S_Hmin and S_Fmin under
    extreme loads; those above if left out. least_dynamic_factor: lowest K_v in place of that of the
    set. least_face_load_factor: lowest K_Hβ in place of that of the set. flank_long_life_factor,
    root_long_life_factor: Z_NT and Y_NT at 1e10 cycles, 0.85, or up to 1 for the best material,
    manufacture and experience. bounded_life_factors: whether these are the least values, so that a
    stress below that of 1e10 cycles does no damage, in place of curves that fall on.
    profile_modification_factor: f_ZCa of the edition of 2019, in Z_B and Z_D of helical gears: 1.2
    without profile modification, 1.07 with a modification by experience, 1 with one that is
    verified by a computed load distribution, as manuals of gear programs describe it; 1 if left
    out. pitch_deviation_share: share of the base pitch deviation in K_Hα and K_Fα; 0.5 where
    profile modifications compensate deflections of the teeth under load. limited_pitting: whether
    some pits are allowed (not on nitrided flanks). static_factors: whether factors of lubricant,
    roughness, notch and size hold for any number of cycles ("constant"), also on the curve beyond
    its first knee up to the strength with the factors of static stress ("extended", as the example
    of ISO 6336-6, annex C), or approach these below the knee of the curve ("interpolated", ISO
    6336-2 and -3 method B).

    deviations: manufacturing errors of the trains for which load factors are computed: "stated",
    only the case's errors; "worst", these and f_ma = √Σf_Hβ² of the gears' accuracy grades on
    planets' flanks, with either sign towards sun and ring, the worst of five trains; "drawn", the
    worst of samples drawn by ``tolerance``. deviation_samples: number of samples.

    dynamic_factor: K_v by ISO 6336-1 method B, or by transients of the train at the speed and
    torque of every load case (seconds each), with the case's errors as deviations of teeth.
    gear_meshes: load factors of some gear meshes. gear_mesh_cycles: largest number of gear-mesh
    cycles of each stage for load factors, spread over a revolution of the carrier;
    positions_per_gear_mesh: equilibria in each cycle; 8 if left out, and 32 for spur gears with
    load along the face, whose stress is largest at the ends of single contact.
    """

    edition: Literal[2006, 2019] = 2019
    application_factor: float | None = Field(default=1.0, ge=0.1, le=10.0)
    limits: Literal["none", "wind"] = "none"
    least_flank_safety: float | None = Field(default=None, ge=0.5, le=5.0)
    least_root_safety: float | None = Field(default=None, ge=0.5, le=5.0)
    least_static_flank_safety: float | None = Field(default=None, ge=0.5, le=5.0)
    least_static_root_safety: float | None = Field(default=None, ge=0.5, le=5.0)
    least_dynamic_factor: float | None = Field(default=None, ge=1.0, le=3.0)
    least_face_load_factor: float | None = Field(default=None, ge=1.0, le=5.0)
    flank_long_life_factor: float = Field(default=0.85, ge=0.85, le=1.0)
    root_long_life_factor: float = Field(default=0.85, ge=0.85, le=1.0)
    bounded_life_factors: bool = False
    profile_modification_factor: float | None = Field(default=None, ge=1.0, le=1.2)
    pitch_deviation_share: float = Field(default=1.0, ge=0.5, le=1.0)
    limited_pitting: bool = False
    static_factors: Literal["constant", "extended", "interpolated"] = "constant"
    dynamic_factor: Literal["method_b", "train"] = "method_b"
    gear_meshes: tuple[RatedGearMesh, ...] = ()
    deviations: Literal["stated", "worst", "drawn"] = "stated"
    deviation_samples: int = Field(default=10, ge=1, le=100)
    gear_mesh_cycles: int = Field(default=7, ge=1, le=10000)
    positions_per_gear_mesh: int | None = Field(default=None, ge=2, le=1000)

    def forced(self, stage: str, kind: str) -> ForcedFactors:
        """Prescribed factors of the gear meshes "sun" or "ring" of a stage.

        The last entry of ``gear_meshes`` that applies to them takes precedence.
        """
        stated = self._stated(ForcedFactors.model_fields)
        for factors in self.gear_meshes:
            if factors.applies(stage, kind):
                stated |= factors._stated(ForcedFactors.model_fields)
        return ForcedFactors(**stated)

    def in_load_case(self, factors: Sequence[RatedGearMesh], extreme: bool) -> Rating:
        """These rules with the load factors of one load case in the place of those for all, and,
        for an extreme load, with the least safeties of static loads."""
        update: dict[str, Any] = {"gear_meshes": (*self.gear_meshes, *factors)}
        for kind in ("flank_safety", "root_safety") if extreme else ():
            stated: float | None = getattr(self, f"least_static_{kind}")
            update[f"least_{kind}"] = self.least(kind) if stated is None else stated
        return self.model_copy(update=update)

    def face_width(self, stage: str, kind: str) -> float | None:
        """Common face width of the gear meshes "sun" or "ring" of a stage, m; None if not given."""
        of_kind = [f.face_width for f in self.gear_meshes if f.applies(stage, kind)]
        return next(filter(None, reversed(of_kind)), None)

    def least(self, name: str) -> float:
        """Minimum of "flank_safety", "root_safety", "dynamic_factor" or "face_load_factor": the key
        if it is given, else the value of the set ``limits``."""
        stated: float | None = getattr(self, f"least_{name}")
        return LIMITS[self.limits][name] if stated is None else stated


def check_rating(case: Case) -> None:
    """Raise Refusal for factors of a stage that the case does not have."""
    names = [stage.name for stage in case.stages]
    of_rules = {f"rating.gear_meshes.{k}": f for k, f in enumerate(case.rating.gear_meshes)}
    of_loads = {
        f"load_cases.{n}.gear_meshes.{k}": factors
        for n, load_case in enumerate(case.load_cases)
        for k, factors in enumerate(load_case.gear_meshes)
    }
    for key, factors in {**of_rules, **of_loads}.items():
        if factors.stage not in (None, *names):
            problem = f"{echo(factors.stage)} is no stage"
            raise Refusal(f"{key}.stage", problem, nearest(str(factors.stage), names))


def check_thrust(case: Case) -> None:
    """Raise Refusal for a bearing that takes thrust in one direction, unless its member has exactly
    one bearing for the other direction."""
    for places in (case.view(stage.name).bearings for stage in case.stages):
        for place in filter(lambda each: each.direction, places):
            directions = [p.direction for p in places if p.part == place.part and p.direction]
            if set(directions) != {"+z", "-z"} or len(directions) > 2:
                problem = f"is given by {len(directions)} of the bearings of its {place.part}"
                remedy = 'give it for two, "+z" and "-z", or take it out'
                raise Refusal(f"{place.key}.thrust.direction", problem, remedy)
