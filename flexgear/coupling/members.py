"""Bodies of a stage, member by member: lumped, finite-element bodies and shafts."""

from __future__ import annotations

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
RIM_MODULES = 4.0  # rim of a ring outside its root circle where none is given, in modules


@dataclass(frozen=True)
class Port:
    """Where others touch a body: a node; its motion in axes turned by ``axes`` (rad) about z, at a
    point that is ``arm`` (m) along their x and ``rise`` (m) along z away and moves with it rigidly.
    floats: the node has the
    elastic displacement alone, in a frame that turns, beside the rigid motion of the body's first
    node."""

    node: str
    axes: float = 0.0
    arm: float = 0.0
    rise: float = 0.0
    floats: bool = False


@dataclass(frozen=True)
class Member:
    """One body of a stage.

    part: the member that it belongs to: a hub, on which an FE ring that turns is held, to "ring",
    what hangs behind the spline of a sun's shaft to "sun". ports: beside the body's nodes, "end"
    where it meets the rest of the train, "gear", "bore", "pin_1" …; contacts: nodes on which gear
    meshes act, one or one a tooth; frame: in which its coordinates turn. mass: kg; inertia: polar,
    tilt: about a diameter, kg m²; of lumped bodies alone.
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
        """Number from 0, −1 of other bodies."""
        return self.body.name.planet

    @property
    def floats(self) -> bool:
        """Whether its contacts are its rigid motion, then the elastic displacement of its teeth."""
        return any(port.floats for port in self.ports.values())

    @property
    def lumped(self) -> bool:
        """Whether the body is a point with inertia."""
        return len(self.body.node_names) == 1

    def port(self, name: str) -> Port:
        """The port of that name, of which nodes are some."""
        return self.ports.get(name) or Port(name)


def stage_members(
    view: StageView, bodies: Mapping[BodyName, AnyBody], rigid: Collection[BodyName] = ()
) -> list[Member]:
    """All bodies of a stage: members, planets, then hub and the body behind the sun's spline.

    bodies: its FE bodies; rigid: rigid ones of these and of shafts, by ``FeBody.rigid`` if they are
    not in ``bodies``. Names are "<stage>.ring", "<stage>.planet_1", …; a sun on a shaft is
    "<stage>.shaft". FlexgearError where a flexible FE body is missing.
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
    """Whether a member has a rotation about its axis: not so if it is held fast, or an FE body."""
    form, member = view.stage.form(part), MemberName.of(view.name, part)
    if form == "beam":
        return True
    if form == "fe":
        return not view.is_held(part)
    fast = view.is_held(part) and not view.stage.member(part).holds_rotation
    return view.case.kinematics_of(member) != "fixed" and not fast


def mass_properties(view: StageView, part: str) -> tuple[float, float, float]:
    """Mass (kg), polar and diametral inertia (kg m²) of one member.

    What is not given is that of a hollow steel cylinder: gears between bore and reference circle,
    rings between reference circle and rim (four modules outside the root where no rim is given),
    carriers a disc of the pins' circle, all as wide as the gears.
    """
    stage = view.stage
    member, width = stage.member(part), stage.gear_width
    if part == "ring" and stage.double_helical:
        width = stage.face_width
    inner, outer = _radii_of(view, part, member)
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
    """Sun gear and its shaft."""
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


def _fe_body(view: StageView, name: BodyName, body: AnyBody | None, bends: bool) -> Body:
    if not bends:
        return body if isinstance(body, Body) else fe_sources(view)[name].rigid()
    if body is None or isinstance(body, Body):
        raise FlexgearError(f"the reduced {name.part} of stage {view.name} is missing")
    return body.as_body()


def _flexible(view: StageView, part: str, body: Body) -> Member:
    """An FE body, or a shaft: its teeth are contacts, "drive" or "end" is its end. The end of a
    shaft is behind its spline, where a body hangs there."""
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
    """Planets of one reduced body, each turned so that its teeth stand where they mesh."""
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
    """The bodies of a lumped member: all planets, both halves of a double-helical ring. The gear of
    a parallel stage, whose axis x comes from the pinion, meets others in the stage's axes."""
    angles, fast = view.stage.planet_angles, not can_turn(view, part)
    mass, polar, tilt = mass_properties(view, part)
    kinematics, out = view.case.kinematics_of(MemberName.of(view.name, part)), []
    for name in view.stage.body_names(part):
        body = lumped_body(name, mass, (tilt, tilt, polar), kinematics, held=fast)
        axes = angles[0] if part == "gear" else 0.0
        ports = {"end": Port(name, axes), "gear": Port(name, axes), "bore": Port(name)}
        if part == "carrier":
            for k, angle in enumerate(angles, 1):
                ports[f"pin_{k}"] = Port(name, -angle, stage_radii(view).center_distance)
        out.append(Member(body, part, ports, [name], "carrier", mass, polar, tilt))
    return out


def _hub(view: StageView) -> list[Member]:
    """The hub that carries an FE ring that turns."""
    if view.stage.form("ring") != "fe" or not can_turn(view, "ring"):
        return []
    hub = view.stage.ring.hub if view.stage.ring else None
    assert hub is not None  # the model asks for it
    mass, tilt = hub.mass or 0.0, hub.tilt_inertia or 0.0
    inertia = (tilt, tilt, hub.inertia)
    body = lumped_body(BodyName.of(view.name, "hub"), mass, inertia, hub.kinematics)
    body = replace(body, positions=np.array([[0.0, 0.0, hub.z]]))
    ports = {"end": Port(body.name)}
    return [Member(body, "ring", ports, (), "ring", mass, hub.inertia, tilt)]


def _behind_spline(view: StageView, members: list[Member]) -> list[Member]:
    """The body behind the spline of a sun's shaft; none where another stage is joined there, which
    has its own bodies."""
    port = view.case.port_at(MemberName.of(view.name, "sun"))
    if view.stage.form("sun") != "beam" or port is None:
        return []
    assert port.mass is not None and port.tilt_inertia is not None  # the model asks for them
    tilt, polar = port.tilt_inertia, port.inertia or 0.0
    body = lumped_body(BodyName.of(view.name, "output"), port.mass, (tilt, tilt, polar))
    shaft = next(m.body for m in members if m.part == "sun")
    body = replace(body, positions=shaft.positions[-1:].copy())
    return [Member(body, "sun", {"end": Port(body.name)}, (), "carrier", port.mass, polar, tilt)]


def _radii_of(
    view: StageView, part: str, member: GearMember | CarrierMember
) -> tuple[float, float]:
    """Inner and outer radius of the steel disc, m."""
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
