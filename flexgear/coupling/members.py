"""Bodies of the members of a stage: lumped bodies, finite-element bodies and shafts."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from flexgear.gears.contact import planet_tooth_angle, ring_start
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.radii import role_of, stage_radii
from flexgear.model.errors import FlexgearError
from flexgear.model.member import CarrierMember, GearMember, RingGear
from flexgear.model.names import BodyName, MemberName
from flexgear.model.stage_view import StageView
from flexgear.structures.bodies import Body, lumped_body, rigid_variant
from flexgear.structures.reduced import ReducedBody, floating
from flexgear.structures.shaft import BeamSection, shaft_body
from flexgear.structures.sources.of_case import fe_sources

AnyBody = ReducedBody | Body  # reduced, or rigid
RIM_MODULES = 4.0  # default rim of a ring outside its root circle, modules


@dataclass(frozen=True)
class Port:
    """Point of a body at which springs and gear meshes act.

    node: whose motion it follows; axes: angle of the axes of the motion about z, rad; arm, rise:
    distances of the point from the node along x and z of these axes, rigidly connected, m; floats:
    whether the node has only elastic displacement, in a rotating frame, to which the rigid motion
    of the body's first node adds.
    """

    node: str
    axes: float = 0.0
    arm: float = 0.0
    rise: float = 0.0
    floats: bool = False


@dataclass(frozen=True)
class Member:
    """One body of a stage.

    part: member of the body; the hub of a rotating FE ring belongs to "ring", the body at the port
    of a sun on a shaft to "sun". ports: by name, in addition to nodes: "end" (connection to the
    rest of the train), "gear", "bore", "pin_1" …; contacts: nodes on which gear meshes act, one or
    one for each tooth; frame: rotating frame of the coordinates. mass: kg; inertia: polar, tilt:
    about a diameter, kg m²; zero for FE bodies.
    """

    body: Body
    part: str
    ports: Mapping[str, Port]
    contacts: Sequence[str] = ()
    frame: Literal["carrier", "ring"] = "carrier"
    mass: float = 0.0
    inertia: float = 0.0
    tilt: float = 0.0

    @property
    def planet(self) -> int:
        """Index of the planet from 0, −1 for other bodies."""
        return self.body.name.planet

    @property
    def floats(self) -> bool:
        """Whether contacts are the rigid motion, then elastic displacements of teeth."""
        return any(port.floats for port in self.ports.values())

    @property
    def lumped(self) -> bool:
        """Whether the body is a point with inertia."""
        return len(self.body.node_names) == 1

    def port(self, name: str) -> Port:
        """Port of a name, or the node of that name as a port."""
        return self.ports.get(name) or Port(name)


def stage_members(
    view: StageView, bodies: Mapping[BodyName, AnyBody], rigid: Collection[BodyName] = ()
) -> list[Member]:
    """All bodies of a stage: members, planets, then hub and the body behind the sun's spline.

    bodies: FE bodies; rigid: names of FE bodies and shafts that are rigid, made by ``FeBody.rigid``
    if they are not in ``bodies``. Names are "<stage>.ring", "<stage>.planet_1", …; a sun on a shaft
    is "<stage>.shaft". Raises FlexgearError if a flexible FE body is missing.
    """
    stage, out = view.stage, list[Member]()
    for part in [*stage.members, *(["planet"] if stage.kind == "planetary" else [])]:
        form = stage.form(part)
        name = BodyName.of(stage.name, "shaft" if form == "beam" else part)
        if form == "lumped" or (part == "planet" and name in rigid):
            out += _lumped(view, part)
        elif part == "planet":
            out += _fe_planets(view, bodies.get(name))
        elif form == "beam":
            shaft = rigid_variant(sun_shaft(view)) if name in rigid else sun_shaft(view)
            out.append(_flexible(view, part, replace(shaft, name=name)))
        else:
            body = _fe_body(view, name, bodies.get(name), name not in rigid)
            out.append(_flexible(view, part, replace(body, name=name)))
    return [*out, *_hub(view), *_behind_spline(view, out)]


def can_turn(view: StageView, part: str) -> bool:
    """Whether a member has a rotation about its axis: a held one only with a torsional support."""
    form, member = view.stage.form(part), MemberName.of(view.name, part)
    if form == "beam":
        return True
    if form == "fe":
        return not view.is_held(part)
    is_free = not view.is_held(part) or view.stage.member(part).holds_rotation
    return is_free and view.case.kinematics_of(member) != "fixed"


def mass_properties(view: StageView, part: str) -> tuple[float, float, float]:
    """Mass, kg, polar and diametral inertia, kg m², of one member.

    Defaults are those of a hollow cylinder of the material, as wide as the gears: gears between
    bore and reference circle, rings between reference circle and rim (by default ``RIM_MODULES``),
    carriers a disc of the radius of the pins' circle.
    """
    stage = view.stage
    member, width = stage.member(part), stage.gear_width
    if part == "ring" and stage.double_helical:
        width = stage.face_width
    inner, outer = _disc_radii(view, part, member)
    mass = member.mass
    if mass is None:
        mass = view.material.density * math.pi * (outer**2 - inner**2) * width
    polar = member.inertia
    if polar is None and member.equivalent_mass is not None:
        polar = member.equivalent_mass * stage_radii(view).rotation_radius(part) ** 2
    if polar is None:
        polar = 0.5 * mass * (outer**2 + inner**2)
    tilt = member.tilt_inertia
    return mass, polar, 0.5 * polar + mass * width**2 / 12 if tilt is None else tilt


def sun_shaft(view: StageView) -> Body:
    """Body of a sun gear and its shaft."""
    mass, polar, tilt = mass_properties(view, "sun")
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


def _fe_body(view: StageView, name: BodyName, body: AnyBody | None, flexible: bool) -> Body:
    """FE body of a name as ``Body``; a rigid one is made if ``body`` is not rigid."""
    if not flexible:
        return body if isinstance(body, Body) else fe_sources(view)[name].rigid()
    if body is None or isinstance(body, Body):
        raise FlexgearError(f"the reduced {name.part} of stage {view.name} is missing")
    return body.as_body()


def _flexible(view: StageView, part: str, body: Body) -> Member:
    """Member of an FE body or a shaft: teeth are contacts, the node "drive" or "end" is the end. A
    shaft has no end if there is a body behind its spline."""
    nodes = body.nodes
    teeth = [node for node in nodes if node.kind == "tooth"]
    if view.stage.form(part) == "beam":
        ports = {"gear": Port("sun"), "spline": Port("end")}
        heights = body.positions[:, 2]
        for key, support in view.stage.member(part).supports.items():  # nearest node, seen at z = 0
            node = int(np.argmin(np.abs(heights - support.z)))
            ports[key] = Port(body.node_names[node], rise=-float(heights[node]))
        if view.case.port_at(MemberName.of(view.name, part)) is None:
            ports["end"] = Port("end")
        return Member(body, part, ports, ["sun"])
    ports = {name: Port("drive") for name in ("end", "gear") if "drive" in nodes}
    for pin in (node for node in nodes if node.kind == "pin"):
        ports[pin] = Port(pin, -view.stage.planet_angles[pin.number - 1])
    return Member(body, part, ports, teeth, "ring" if part == "ring" else "carrier")


def _fe_planets(view: StageView, reduced: AnyBody | None) -> list[Member]:
    """Planets of one reduced body, each rotated so that its teeth mesh."""
    if not isinstance(reduced, ReducedBody):
        raise FlexgearError(f"the reduced planet of stage {view.name} is missing")
    stage, g, out = view.stage, stage_geometry(view), []
    turned = planet_tooth_angle(g, ring_start(g, np.asarray(stage.planet_angles)))
    for name, angle in zip(stage.body_names("planet"), turned, strict=True):
        body = floating(reduced, name, float(angle))
        ports = {"gear": Port(name), "bore": Port("bore", floats=True)}
        contacts = [name, *(node for node in body.nodes[1:] if node.kind == "tooth")]
        mass, tilt, polar = (float(body.mass[i, i]) for i in (0, 3, 5))
        out.append(Member(body, "planet", ports, contacts, "carrier", mass, polar, tilt))
    return out


def _lumped(view: StageView, part: str) -> list[Member]:
    """Members of a lumped member's bodies: all planets, both halves of a double-helical ring. Ports
    of the gear of a parallel stage, whose x axis points away from the pinion, are in the axes of
    the stage."""
    angles, held = view.stage.planet_angles, not can_turn(view, part)
    mass, polar, tilt = mass_properties(view, part)
    kinematics, out = view.case.kinematics_of(MemberName.of(view.name, part)), []
    for name in view.stage.body_names(part):
        body = lumped_body(name, mass, (tilt, tilt, polar), kinematics, held=held)
        axes = angles[0] if part == "gear" else 0.0
        ports = {"end": Port(name, axes), "gear": Port(name, axes), "bore": Port(name)}
        if part == "carrier":
            for k, angle in enumerate(angles, 1):
                ports[f"pin_{k}"] = Port(name, -angle, stage_radii(view).center_distance)
        out.append(Member(body, part, ports, [name], "carrier", mass, polar, tilt))
    return out


def _hub(view: StageView) -> list[Member]:
    """Hub of a rotating FE ring, or none."""
    if view.stage.form("ring") != "fe" or not can_turn(view, "ring"):
        return []
    hub = view.stage.ring.hub if view.stage.ring else None
    assert hub is not None  # the model requires it
    mass, tilt = hub.mass or 0.0, hub.tilt_inertia or 0.0
    inertia = (tilt, tilt, hub.inertia)
    body = lumped_body(BodyName.of(view.name, "hub"), mass, inertia, hub.kinematics)
    body = replace(body, positions=np.array([[0.0, 0.0, hub.z]]))
    ports = {"end": Port(body.name)}
    return [Member(body, "ring", ports, (), "ring", mass, hub.inertia, tilt)]


def _behind_spline(view: StageView, members: list[Member]) -> list[Member]:
    """Body behind the spline of a sun's shaft, or none if another stage is joined there."""
    port = view.case.port_at(MemberName.of(view.name, "sun"))
    if view.stage.form("sun") != "beam" or port is None:
        return []
    assert port.mass is not None and port.tilt_inertia is not None  # the model requires them
    tilt, polar = port.tilt_inertia, port.inertia or 0.0
    body = lumped_body(BodyName.of(view.name, "output"), port.mass, (tilt, tilt, polar))
    shaft = next(m.body for m in members if m.part == "sun")
    body = replace(body, positions=shaft.positions[-1:].copy())
    return [Member(body, "sun", {"end": Port(body.name)}, (), "carrier", port.mass, polar, tilt)]


def _disc_radii(
    view: StageView, part: str, member: GearMember | CarrierMember
) -> tuple[float, float]:
    """Inner and outer radius of the disc of ``mass_properties``, m."""
    stage, radii = view.stage, stage_radii(view)
    if isinstance(member, CarrierMember):
        return 0.0, radii.center_distance
    reference = radii.reference[role_of(part)]
    if part != "ring":
        return member.bore_diameter / 2, reference
    rim, root = member.rim_thickness, stage_geometry(view).ring.root_radius
    if isinstance(member, RingGear) and member.fe is not None:
        rim = member.fe.rim_thickness
    return reference, root + (RIM_MODULES * stage.normal_module if rim is None else rim)
