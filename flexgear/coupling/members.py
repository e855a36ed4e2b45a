"""Bodies of a stage, member by member: lumped, finite-element bodies and shafts."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexgear.gears.geometry import stage_geometry
from flexgear.gears.radii import StageRadii, gears_by_role, stage_radii
from flexgear.model.case import Case
from flexgear.model.errors import FlexgearError
from flexgear.model.member import CarrierMember, GearMember, RingGear
from flexgear.model.names import SIDES, BodyName, MemberName
from flexgear.model.stage import Form, Stage
from flexgear.model.stage_view import StageView
from flexgear.structures.bodies import Body, lumped_body, rigid_variant, stiffened
from flexgear.structures.reduced import ReducedBody
from flexgear.structures.shaft import BeamSection, shaft_body
from flexgear.structures.sources.of_case import fe_sources

Array = NDArray[np.float64]
AnyBody = ReducedBody | Body  # reduced, or rigid
RIM_MODULES = 4.0  # rim of a ring outside its root circle where none is given, in modules


@dataclass(frozen=True)
class Member:
    """One body of a stage.

    part: "sun", "ring", "carrier", "planet", "pinion", "gear", or "hub" (what an FE ring that turns
    is held on) and "output" (what hangs behind the spline of a sun's shaft); form: what the body
    is; side: half of a double-helical ring, or ""; planet: number from 0, or −1. radius: r of the
    tangential stiffness, m; mass: kg; inertia: polar, tilt: about a diameter, kg m²; of a shaft
    those of its gear.
    """

    body: Body
    part: str
    form: Form
    side: str = ""
    planet: int = -1
    radius: float = 0.0
    mass: float = 0.0
    inertia: float = 0.0
    tilt: float = 0.0

    @property
    def node(self) -> str:
        """Node that stands for the body: at the gear of a shaft, where an FE carrier is driven."""
        names = {("sun", "beam"): "sun", ("carrier", "fe"): "drive"}
        return names.get((self.part, self.form), self.body.node_names[0])

    @property
    def teeth(self) -> Sequence[str]:
        """Nodes of the teeth of an FE ring; none of any other body."""
        fe_ring = (self.part, self.form) == ("ring", "fe")
        return [node for node in self.body.nodes if fe_ring and node.kind == "tooth"]


def stage_members(
    case: Case,
    stage: Stage,
    bodies: Mapping[BodyName, AnyBody],
    rigid: Collection[BodyName] = (),
    stiffening: Mapping[BodyName, float] | None = None,
) -> list[Member]:
    """All bodies of a stage: members, planets, then hub and what hangs behind the sun's spline.

    bodies: its FE bodies; rigid: which of them, and of shafts, do not bend; those of them that are
    not in ``bodies`` are those of ``FeBody.rigid``; stiffening: factors on elastic stiffness. Names
    are "<stage>.ring", "<stage>.planet_1", …; a sun on a shaft is "<stage>.shaft". FlexgearError
    where an FE body that bends is missing.
    """
    view, out = case.view(stage.name), list[Member]()
    for part in [*stage.members, *(["planet"] if stage.kind == "planetary" else [])]:
        form = stage.form(part)
        if form == "lumped":
            out += _lumped(case, stage, part)
            continue
        name = BodyName.of(stage.name, "shaft" if form == "beam" else part)
        if form == "beam":
            body = rigid_variant(sun_shaft(view)) if name in rigid else sun_shaft(view)
        else:
            body = _fe_body(view, name, bodies.get(name), name not in rigid)
        body = stiffened(body, (stiffening or {}).get(name, 1.0))
        body = replace(body, name=name)
        out.append(Member(body, part, form, "", -1, *_sizes(view, part)))
    return [*out, *_hub(case, stage), *_behind_spline(case, stage, out)]


def can_turn(case: Case, stage: Stage, part: str) -> bool:
    """Whether a member has a rotation about its axis: not so if it is held fast, or an FE body."""
    name, form = MemberName.of(stage.name, part), stage.form(part)
    if form == "beam":
        return True
    held = name in case.held_members()
    if form == "fe":
        return not held
    fast = held and not stage.member(part).support.holds_rotation
    return case.kinematics_of(name) != "fixed" and not fast


def mass_properties(view: StageView, part: str, radii: StageRadii) -> tuple[float, float, float]:
    """Mass (kg), polar and diametral inertia (kg m²) of one member.

    What is not given is that of a hollow steel cylinder: gears between bore and reference circle,
    rings between reference circle and rim (four modules outside the root where no rim is given),
    carriers a disc of the pins' circle, all as wide as the gears.
    """
    stage = view.stage
    member, width = stage.member(part), stage.gear_width
    if part == "ring" and stage.double_helical:
        width = stage.face_width
    inner, outer = _radii_of(view, part, member, radii)
    mass = member.mass
    if mass is None:
        mass = view.material.density * math.pi * (outer**2 - inner**2) * width
    polar = member.inertia
    if polar is None and member.equivalent_mass is not None:
        polar = member.equivalent_mass * reference_radius(stage, part, radii) ** 2
    if polar is None:
        polar = 0.5 * mass * (outer**2 + inner**2)
    tilt = member.tilt_inertia
    return mass, polar, 0.5 * polar + mass * width**2 / 12 if tilt is None else tilt


def reference_radius(stage: Stage, part: str, radii: StageRadii) -> float:
    """r of u = r θ: base radius of a gear, centre distance of a carrier, m."""
    if part == "carrier":
        return radii.center_distance
    return float(getattr(radii, _slot(stage, part)))


def sun_shaft(view: StageView) -> Body:
    """Sun gear and its shaft."""
    mass, polar, tilt = mass_properties(view, "sun", stage_radii(view))
    m, shaft = view.material, view.shaft
    return shaft_body(
        [BeamSection(s.length, s.outer_diameter, s.inner_diameter) for s in shaft.sections],
        young=m.young_modulus,
        poisson=m.poisson_ratio,
        density=m.density,
        direction=-1.0 if shaft.direction == "-z" else 1.0,
        elements_per_section=shaft.elements_per_section,
        end_masses={"sun": np.diag([mass, mass, mass, tilt, tilt, polar])},
    )


def _fe_body(view: StageView, name: BodyName, body: AnyBody | None, bends: bool) -> Body:
    if not bends:
        return body if isinstance(body, Body) else fe_sources(view)[name].rigid()
    if body is None or isinstance(body, Body):
        raise FlexgearError(f"the reduced {name.part} of stage {view.name} is missing")
    return body.as_body()


def _lumped(case: Case, stage: Stage, part: str) -> list[Member]:
    """The bodies of a lumped member: all planets, both halves of a double-helical ring."""
    view, name = case.view(stage.name), MemberName.of(stage.name, part)
    radius, mass, polar, tilt = _sizes(view, part)
    kinematics, fast = case.kinematics_of(name), not can_turn(case, stage, part)
    inertia = (tilt, tilt, polar)
    return [
        Member(
            lumped_body(
                BodyName.of(stage.name, part, planet, side), mass, inertia, kinematics, held=fast
            ),
            part, "lumped", side, planet, radius, mass, polar, tilt,
        )
        for side, planet in _copies(stage, part)
    ]  # fmt: skip


def _hub(case: Case, stage: Stage) -> list[Member]:
    """What an FE ring that turns is held on."""
    if stage.form("ring") != "fe" or not can_turn(case, stage, "ring"):
        return []
    hub = stage.ring.hub if stage.ring else None
    assert hub is not None  # the model asks for it
    mass, tilt = hub.mass or 0.0, hub.tilt_inertia or 0.0
    inertia = (tilt, tilt, hub.inertia)
    body = lumped_body(BodyName.of(stage.name, "hub"), mass, inertia, hub.kinematics)
    body = replace(body, positions=np.array([[0.0, 0.0, hub.z]]))
    return [Member(body, "hub", "lumped", "", -1, 0.0, mass, hub.inertia, tilt)]


def _behind_spline(case: Case, stage: Stage, members: list[Member]) -> list[Member]:
    """What hangs behind the spline of a sun's shaft: nothing where another stage is joined there,
    which has its own bodies."""
    port = case.port_at(MemberName.of(stage.name, "sun"))
    if stage.form("sun") != "beam" or port is None:
        return []
    assert port.mass is not None and port.tilt_inertia is not None  # the model asks for them
    tilt, polar = port.tilt_inertia, port.inertia or 0.0
    body = lumped_body(BodyName.of(stage.name, "output"), port.mass, (tilt, tilt, polar))
    shaft = next(m.body for m in members if m.part == "sun")
    body = replace(body, positions=shaft.positions[-1:].copy())
    return [Member(body, "output", "lumped", "", -1, 0.0, port.mass, polar, tilt)]


def _sizes(view: StageView, part: str) -> tuple[float, float, float, float]:
    """Radius, mass, polar and diametral inertia."""
    radii = stage_radii(view)
    return reference_radius(view.stage, part, radii), *mass_properties(view, part, radii)


def _radii_of(
    view: StageView, part: str, member: GearMember | CarrierMember, radii: StageRadii
) -> tuple[float, float]:
    """Inner and outer radius of the steel disc, m."""
    stage = view.stage
    if isinstance(member, CarrierMember):
        return 0.0, radii.center_distance
    reference = getattr(radii, f"{_slot(stage, part)}_reference")
    if part != "ring":
        return member.bore_diameter / 2, reference
    rim, root = member.rim_thickness, stage_geometry(view).ring.root_radius
    if isinstance(member, RingGear) and member.fe is not None:
        rim = member.fe.rim_thickness
    return reference, root + (RIM_MODULES * stage.normal_module if rim is None else rim)


def _slot(stage: Stage, part: str) -> str:
    gears = gears_by_role(stage)
    return next(role for role, gear in gears.items() if gear is stage.member(part))


def _copies(stage: Stage, part: str) -> list[tuple[str, int]]:
    """Side and planet of every body that a member stands for."""
    if part == "planet":
        return [("", i) for i in range(stage.planets)]
    if part == "ring" and stage.double_helical:
        return [(side, -1) for side in SIDES]
    return [("", -1)]
