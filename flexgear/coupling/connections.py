"""Connections of a stage: springs between ports of its bodies, and its gear meshes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal

import numpy as np

from flexgear.arrays import Array
from flexgear.coupling.gear_meshes import (
    GearBlock,
    GearBlocks,
    GearMeshSet,
    StageFrame,
)
from flexgear.coupling.members import can_turn, mass_properties
from flexgear.coupling.springs import linear_part
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.errors import stage_errors
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.paths import PathKey, stage_paths
from flexgear.gears.power_flow import StageFlow
from flexgear.gears.radii import stage_radii
from flexgear.gears.slices import Nominal, Slices, bent
from flexgear.gears.stiffness import line_load
from flexgear.gears.tooth_faults import FaultGroups, fault_groups, with_faults
from flexgear.model.bearings import Bearing
from flexgear.model.faults import Fault, bearing_defects
from flexgear.model.names import BodyName, SupportName
from flexgear.model.stage_view import StageView
from flexgear.structures.reduced import RimFlexibility
from flexgear.structures.sources.ring import source as ring_source

End = tuple[BodyName, str]  # a body and one of its ports
Bent = Callable[[GearMeshPath, Array | None], GearMeshPath]  # slices bend each other, and ΔC


@dataclass(frozen=True)
class Connection:
    """A spring between two ports: force = matrix @ (motion of the first − motion of the second).

    name: of its link, and of the node of an FE housing on which it stands; second: None for the
    housing; matrix: (6, 6) SI; axes: angle of the axes in which it acts, rad; kind: see ``Link``;
    frame: of the first port, turning against the housing, "" where it stands; bearing: that acts
    beside the spring by a law of its own, if it has one, of the first body on the housing or of the
    second on the first; reaches: the second body reaches rigidly to where the first port is; key:
    of the spring in the case, where that can be wrong; defects: of the bearing.
    """

    name: SupportName
    first: End
    second: End | None
    matrix: Array = field(repr=False)
    axes: float = 0.0
    kind: str = ""
    frame: Literal["", "carrier", "ring"] = ""
    bearing: Bearing | None = None
    reaches: bool = False
    key: str = ""
    defects: tuple[Fault, ...] = ()


def connections(view: StageView) -> Iterator[Connection]:
    """All springs of a stage; InputError for those with which it could not roll or hold."""
    stage = view.stage
    forms = {"ring fe": _of_fe_ring, "carrier fe": _of_seats, "sun beam": _of_shaft}
    for part in stage.members:
        yield from forms.get(f"{part} {stage.form(part)}", _of_supports)(view, part)
    if stage.kind == "planetary":
        yield from _of_planets(view)
    yield from _of_hub(view)
    yield from _behind_spline(view)


def spline_matrix(view: StageView) -> Array:
    """Stiffness (6, 6) of the spline at the end of the sun's shaft, SI."""
    return np.diag(np.asarray(view.shaft.spline.stiffness, dtype=float))


def _of_supports(view: StageView, part: str) -> Iterator[Connection]:
    """Supports of each body of a member at its gear, of both halves of a double-helical lumped
    ring, or along its shaft; the tangential spring as torsion k r²."""
    for key, support in view.stage.member(part).supports.items():
        matrix = np.array(support.matrix, dtype=float)
        matrix[5, 5] += support.tangential * stage_radii(view).rotation_radius(part) ** 2
        matrix = linear_part(support, matrix)
        bodies = view.stage.body_names(part)
        port = key if view.stage.form(part) == "beam" else "gear"
        for name, body in zip(view.support_names(part, key), bodies, strict=True):
            yield from _held(name, (body, port), matrix, view.key(f"{part}.{key}"), support)


def _of_shaft(view: StageView, part: str) -> Iterator[Connection]:
    """The spline of a sun that is held, and the supports of its shaft."""
    shaft = BodyName.of(view.name, "shaft")
    if view.is_held(part):
        place = SupportName.of(f"{view.name}.spline")
        key = view.key("sun.shaft.spline")
        yield from _held(place, (shaft, "spline"), spline_matrix(view), key)
    yield from _of_supports(view, part)


def _of_fe_ring(view: StageView, part: str) -> Iterator[Connection]:
    """Bolts, fits and splines on the housing where the ring is held, else on the hub with which it
    turns."""
    ring, hub = BodyName.of(view.name, part), (BodyName.of(view.name, "hub"), "end")
    held = view.is_held(part)
    for spring in ring_source(view).whole_springs:
        yield Connection(
            SupportName.of(f"{view.name}.{spring.node}"),
            (ring, spring.node),
            None if held else hub,
            spring.matrix,
            spring.angle,
            spring.node.kind,
            reaches=True,
        )


def _of_seats(view: StageView, part: str) -> Iterator[Connection]:
    """Bearings on the seats of an FE carrier."""
    carrier, bearings = BodyName.of(view.name, part), view.stage.seat_bearings
    if view.is_held(part) and not any(bearing.stiffness[5] for bearing in bearings.values()):
        raise view.refuse(
            "carrier.bearing_drive.torsion_nm_per_rad",
            f"is zero, so nothing takes the torque of the held {carrier}",
            "give it, or that of bearing_far",
        )
    for side, bearing in bearings.items():
        place = SupportName.of(f"{carrier}_{side}")
        key = f"carrier.bearing_{side}"
        seat = _bearing(place, (carrier, f"bearing_{side}"), bearing, "carrier", view.key(key))
        yield replace(seat, defects=bearing_defects(view.case, view.name, key))


def _of_planets(view: StageView) -> Iterator[Connection]:
    """Bearings of planets on the pins of their carrier, in each planet's axes."""
    bearing, carrier = view.stage.planet_bearing, BodyName.of(view.name, "carrier")
    if np.any(bearing.matrix[5] != 0):
        raise view.refuse(
            "planet_bearing",
            "holds the planet's rotation about its axis, so the gears could not roll",
            "set the stiffness about z (torsion, row 6) to zero",
        )
    matrix = linear_part(bearing, bearing.matrix)
    defects = bearing_defects(view.case, view.name, "planet_bearing")
    for number, planet in enumerate(view.stage.body_names("planet"), 1):
        yield Connection(
            SupportName.of(f"{view.name}.planet_bearing_{number}"),
            (carrier, f"pin_{number}"),
            (planet, "bore"),
            matrix,
            kind="planet_bearing",
            bearing=bearing,
            key=view.key("planet_bearing"),
            defects=tuple(defect for defect in defects if defect.planet == number),
        )


def _of_hub(view: StageView) -> Iterator[Connection]:
    """The bearing of what an FE ring that turns is held on."""
    hub = view.stage.ring.hub if view.stage.ring is not None else None
    if hub is not None and hub.bearing is not None and not view.is_held("ring"):
        body = BodyName.of(view.name, "hub")
        key = view.key("ring.hub.bearing")
        yield _bearing(SupportName.of(body), (body, "end"), hub.bearing, "ring", key)


def _behind_spline(view: StageView) -> Iterator[Connection]:
    """The spline between a sun's shaft and the body behind it, and that body's bearing."""
    port = view.case.port_at(f"{view.name}.sun")
    if port is None or view.stage.form("sun") != "beam":
        return
    shaft, output = (BodyName.of(view.name, part) for part in ("shaft", "output"))
    name = SupportName.of(f"{view.name}.spline")
    yield Connection(name, (shaft, "spline"), (output, "end"), spline_matrix(view))
    if port.bearing is not None:
        place = SupportName.of(output)
        yield _bearing(place, (output, "end"), port.bearing, "carrier", "output.bearing")


def _bearing(
    name: SupportName, end: End, bearing: Bearing, frame: Literal["carrier", "ring"], key: str
) -> Connection:
    """A bearing on the housing: its springs and its law."""
    matrix = linear_part(bearing, bearing.matrix)
    return Connection(name, end, None, matrix, frame=frame, bearing=bearing, key=key)


def _held(
    place: SupportName, end: End, matrix: Array, key: str, bearing: Bearing | None = None
) -> Iterator[Connection]:
    """A support on the housing as two springs: its torsional stiffness about the axis, which is the
    same in every frame, and the rest, in the carrier's frame."""
    torsion, rest = np.zeros((6, 6)), np.array(matrix)
    torsion[5, 5], rest[5, 5] = matrix[5, 5], 0.0
    yield Connection(SupportName.of(place.place, "torsion"), end, None, torsion)
    yield Connection(place, end, None, rest, frame="carrier", bearing=bearing, key=key)


def flanks(
    view: StageView, paths: Mapping[PathKey, GearMeshPath]
) -> Iterator[tuple[GearMeshPath, float]]:
    """Paths of the flanks that may carry, with the linear law those of the rated torque alone, and
    the equivalent mass on their line of action, kg: 1/m = r_bp²/J_p + r_b²/J, without the second
    term where the gear is held."""
    planet = view.part("planet")
    for path in paths.values():
        if not path.carries and view.gear_mesh.contact_law == "linear":
            continue
        part = view.part(path.kind.gear)
        inverse = path.base_radius_planet**2 / mass_properties(view, planet)[1]
        if can_turn(view, part):
            inverse += path.base_radius_gear**2 / mass_properties(view, part)[1]
        yield path, 1.0 / inverse


def stage_sets(
    view: StageView,
    number: int,
    flow: StageFlow,
    frame: StageFrame,
    blocks: GearBlocks,
    bending: bool,
    rims: Mapping[str, RimFlexibility],
) -> list[GearMeshSet]:
    """Gear meshes of stage ``number`` of a train; bending: slices have FE influence where the case
    says so, from the cache or computed (half a minute each); rims: additional flexibility of
    the teeth of "ring" and "planet"."""
    stage, out = view.stage, list[GearMeshSet]()
    paths = stage_paths(view, flow.gear_mesh_forces)
    errors, planet = stage_errors(view, paths), view.part("planet")
    for path, mass in flanks(view, paths):
        kind, side, faults = path.kind, path.side, fault_groups(view, path)
        force, bend = flow.gear_mesh_forces[kind.gear], None
        if bending and bend_each_other(view):
            bend = _bending(view, path, force, rims)

        def block(part: str, number: int, side: str = side) -> GearBlock:
            return blocks.get((part, number, side)) or blocks[part, number, ""]

        numbers = range(stage.planets) if planet == "planet" else [-1]
        out.append(
            GearMeshSet(
                paths=list(_faulty_paths(view, path, force, faults, bend, bending)),
                faults=faults,
                errors=errors[kind, side],
                stage=number,
                frame=frame,
                phi=np.asarray(stage.planet_angles, dtype=float),
                gear=block(view.part(kind.gear), -1),
                planets=[block(planet, i) for i in numbers],
                equivalent_mass=mass,
                options=view.gear_mesh,
            )
        )
    return out


def _bending(
    view: StageView, path: GearMeshPath, force: float, rims: Mapping[str, RimFlexibility]
) -> Bent:
    """Makes slices of this path bend each other, those of sound teeth and of faulty ones."""
    # half of the package, for cases that ask for it alone
    from flexgear.structures.tooth_influence.of_case import pair_bending
    from flexgear.structures.tooth_influence.rim import rim_bending

    assert path.slices is not None
    load = line_load(view, stage_geometry(view), path.kind.gear, force)
    compliance = pair_bending(view, path, path.slices, force)
    for member, part in enumerate(("planet", path.kind.gear)):
        if part in rims:
            compliance = compliance.with_rim(*rim_bending(rims[part], path, path.slices, member))
    nominal = Nominal(load / path.cos_base_helix, path.base_pitch)
    contact = (compliance.scale, compliance.limit)

    def bend(of_teeth: GearMeshPath, more: Array | None) -> GearMeshPath:
        assert of_teeth.slices is not None
        flexibility = compliance.flexibility if more is None else compliance.flexibility + more
        lines = bent(of_teeth.slices, flexibility, compliance.beside, contact, nominal)
        return replace(of_teeth, slices=lines)

    return bend


def _softness(
    view: StageView, cracked: Sequence[Fault], path: GearMeshPath, lines: Slices
) -> Array:
    """ΔC (S, K, K) m/N of cracked teeth together."""
    # half of the package, for cases that have cracks
    from flexgear.structures.tooth_influence.of_case import crack_flexibility

    return np.sum([crack_flexibility(view, path, lines, fault) for fault in cracked], axis=0)


def _faulty_paths(
    view: StageView,
    path: GearMeshPath,
    force: float,
    groups: FaultGroups,
    bend: Bent | None,
    cracks: bool,
) -> Iterator[GearMeshPath]:
    """Those of a stage's gear meshes of one kind, in the order of ``FaultGroups``.

    path: of sound teeth, as slices are before they bend each other; force: of the gear mesh, N;
    bend: makes them so with ΔC (S, K, K) m/N of cracks besides, None where they are springs beside
    each other; cracks: whether what they yield is computed (half a minute each, kept).
    """
    for faults in groups.of_pairs:
        cracked = [f for _, f in faults if f.kind == "root_crack" and cracks]
        softness = partial(_softness, view, cracked) if cracked else None
        if bend is None:
            yield with_faults(view, path, force, faults, softness)
            continue
        assert path.slices is not None
        more = softness(path, path.slices) if softness else None
        yield bend(with_faults(view, path, force, faults, None), more)


def bend_each_other(view: StageView) -> bool:
    """Whether the slices of a stage's tooth pairs do, by FE influences."""
    options = view.gear_mesh
    return options.model == "face_load" and options.tooth_compliance == "fe"
