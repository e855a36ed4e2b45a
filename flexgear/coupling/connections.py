"""Connections of a stage: springs between ports of its bodies, and its gear meshes."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal

import numpy as np

from flexgear.arrays import Array
from flexgear.coupling.gear_meshes import GearBlock, GearBlocks, GearMeshSet, StageFrame
from flexgear.coupling.members import can_turn, mass_properties
from flexgear.coupling.springs import linear_part
from flexgear.gears.contact import GearMeshPath
from flexgear.gears.errors import stage_errors
from flexgear.gears.geometry import stage_geometry
from flexgear.gears.paths import PathKey, stage_paths
from flexgear.gears.power_flow import StageFlow
from flexgear.gears.radii import stage_radii
from flexgear.gears.slices import NominalLoad, Slices, with_flexibility
from flexgear.gears.stiffness import line_load
from flexgear.gears.tooth_faults import FaultGroups, fault_groups, with_faults
from flexgear.model.bearings import Bearing
from flexgear.model.faults import Fault, bearing_defects
from flexgear.model.names import BodyName, SupportName
from flexgear.model.stage_view import StageView
from flexgear.structures.reduced import RimFlexibility
from flexgear.structures.sources.ring import source as ring_source

End = tuple[BodyName, str]  # body and port
Coupling = Callable[[GearMeshPath, Array | None], GearMeshPath]  # couples slices, with ΔC of cracks


@dataclass(frozen=True)
class Connection:
    """Spring between two ports: force = matrix @ (motion of the first − motion of the second).

    name: of the link, and of its node on an FE housing; second: None for the housing; matrix:
    (6, 6) SI; axes: angle of the axes in which it acts, rad; kind: see ``Link``; frame: rotating
    frame of the first port for a spring on the housing, "" for none; bearing: whose nonlinear law,
    if any, acts in addition (inner ring on the first port for the housing, else on the second);
    reaches: whether the second body extends rigidly to the first port; key: of the spring in the
    case, for messages; defects: of the bearing.
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
    """All springs of a stage. Raises InputError for springs that prevent rolling, or a held member
    without support of its torque."""
    stage = view.stage
    forms = {"ring fe": _ring_supports, "carrier fe": _seat_bearings, "sun beam": _shaft_supports}
    for part in stage.members:
        yield from forms.get(f"{part} {stage.form(part)}", _member_supports)(view, part)
    if stage.kind == "planetary":
        yield from _planet_bearings(view)
    yield from _hub_bearing(view)
    yield from _behind_spline(view)


def spline_matrix(view: StageView) -> Array:
    """Stiffness (6, 6) of the spline at the end of the sun's shaft, SI."""
    return np.diag(np.asarray(view.shaft.spline.stiffness, dtype=float))


def _member_supports(view: StageView, part: str) -> Iterator[Connection]:
    """Supports of every body of a member at its gear, of both halves of a double-helical lumped
    ring, or along its shaft. A tangential spring k adds k r² in torsion."""
    for key, support in view.stage.member(part).supports.items():
        matrix = np.array(support.matrix, dtype=float)
        matrix[5, 5] += support.tangential * stage_radii(view).rotation_radius(part) ** 2
        matrix = linear_part(support, matrix)
        support_key = view.key(f"{part}.{key}")
        bodies = view.stage.body_names(part)
        port = key if view.stage.form(part) == "beam" else "gear"
        defects = bearing_defects(view.case, view.name, f"{part}.{key}")
        for name, body in zip(view.support_names(part, key), bodies, strict=True):
            for spring in _housing_springs(name, (body, port), matrix, support_key, support):
                yield replace(spring, defects=defects)


def _shaft_supports(view: StageView, part: str) -> Iterator[Connection]:
    """Spline of a held sun on a shaft, and the supports of the shaft."""
    shaft = BodyName.of(view.name, "shaft")
    if view.is_held(part):
        place = SupportName.of(f"{view.name}.spline")
        key = view.key("sun.shaft.spline")
        yield from _housing_springs(place, (shaft, "spline"), spline_matrix(view), key)
    yield from _member_supports(view, part)


def _ring_supports(view: StageView, part: str) -> Iterator[Connection]:
    """Bolts, fits and splines of an FE ring: on the housing if it is held, else on its hub."""
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


def _seat_bearings(view: StageView, part: str) -> Iterator[Connection]:
    """Bearings on the seats of an FE carrier."""
    carrier, bearings = BodyName.of(view.name, part), view.stage.seat_bearings
    if view.is_held(part) and not any(bearing.stiffness[5] for bearing in bearings.values()):
        problem = f"is zero, so nothing takes the torque of the held {carrier}"
        remedy = "give it, or that of bearing_far"
        raise view.refuse("carrier.bearing_drive.torsion_nm_per_rad", problem, remedy)
    for side, bearing in bearings.items():
        place = SupportName.of(f"{carrier}_{side}")
        key = f"carrier.bearing_{side}"
        yield _bearing(view, place, (carrier, f"bearing_{side}"), bearing, "carrier", key)


def _planet_bearings(view: StageView) -> Iterator[Connection]:
    """Bearings of planets on the pins of their carrier, in each planet's axes."""
    bearing, carrier = view.stage.planet_bearing, BodyName.of(view.name, "carrier")
    if np.any(bearing.matrix[5] != 0):
        problem = "holds the planet's rotation about its axis, so the gears could not roll"
        remedy = "set the stiffness about z (torsion, row 6) to zero"
        raise view.refuse("planet_bearing", problem, remedy)
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


def _hub_bearing(view: StageView) -> Iterator[Connection]:
    """Bearing of the hub of a rotating FE ring."""
    hub = view.stage.ring.hub if view.stage.ring is not None else None
    if hub is not None and hub.bearing is not None and not view.is_held("ring"):
        body = BodyName.of(view.name, "hub")
        place = SupportName.of(body)
        yield _bearing(view, place, (body, "end"), hub.bearing, "ring", "ring.hub.bearing")


def _behind_spline(view: StageView) -> Iterator[Connection]:
    """Spline between a sun's shaft and the body at its port, and the bearing of that body."""
    port = view.case.port_at(f"{view.name}.sun")
    if port is None or view.stage.form("sun") != "beam":
        return
    shaft, output = (BodyName.of(view.name, part) for part in ("shaft", "output"))
    name = SupportName.of(f"{view.name}.spline")
    yield Connection(name, (shaft, "spline"), (output, "end"), spline_matrix(view))
    if port.bearing is not None:
        place = SupportName.of(output)
        number = view.case.ports.index(port)
        key = "output.bearing" if port is view.case.output else f"inputs[{number}].bearing"
        bearing = _bearing(view, place, (output, "end"), port.bearing, "carrier", key)
        yield replace(bearing, key=key)


def _bearing(
    view: StageView, name: SupportName, end: End, bearing: Bearing,
    frame: Literal["carrier", "ring"], key: str,
) -> Connection:  # fmt: skip
    """Bearing on the housing in a rotating frame, with its springs, its law and its defects; key:
    below the stage."""
    matrix = linear_part(bearing, bearing.matrix)
    defects = bearing_defects(view.case, view.name, key)
    return Connection(
        name, end, None, matrix, frame=frame, bearing=bearing, key=view.key(key), defects=defects
    )


def _housing_springs(
    place: SupportName, end: End, matrix: Array, key: str, bearing: Bearing | None = None
) -> Iterator[Connection]:
    """Support on the housing as two springs: torsional stiffness about the axis, which is the same
    in every frame, and all other components in the carrier's frame."""
    torsion, others = np.zeros((6, 6)), np.array(matrix)
    torsion[5, 5], others[5, 5] = matrix[5, 5], 0.0
    yield Connection(SupportName.of(place.place, "torsion"), end, None, torsion)
    yield Connection(place, end, None, others, frame="carrier", bearing=bearing, key=key)


def flanks(
    view: StageView, paths: Mapping[PathKey, GearMeshPath]
) -> Iterator[tuple[GearMeshPath, float]]:
    """Paths of flanks that may carry, and the equivalent mass on each line of action, kg. 1/m =
    r_bp²/J_p + r_b²/J, without the second term for a held gear. With linear contact only the flanks
    that carry the rated torque."""
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
    """Gear meshes of stage ``number`` of a train. bending: whether slices are coupled by FE
    influences if the case asks for them, from the cache or computed (half a minute each); rims:
    additional flexibility of the teeth of "ring" and "planet"."""
    stage, out = view.stage, list[GearMeshSet]()
    paths = stage_paths(view, flow.gear_mesh_forces)
    errors, planet = stage_errors(view, paths), view.part("planet")
    for path, mass in flanks(view, paths):
        kind, side, faults = path.kind, path.side, fault_groups(view, path)
        force, couple = flow.gear_mesh_forces[kind.gear], None
        if bending and has_coupled_slices(view):
            couple = _slice_coupling(view, path, force, rims)

        def block(part: str, number: int, side: str = side) -> GearBlock:
            return blocks.get((part, number, side)) or blocks[part, number, ""]

        numbers = range(stage.planets) if planet == "planet" else [-1]
        out.append(
            GearMeshSet(
                paths=list(_faulty_paths(view, path, force, faults, couple, bending)),
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


def _slice_coupling(
    view: StageView, path: GearMeshPath, force: float, rims: Mapping[str, RimFlexibility]
) -> Coupling:
    """Function that couples the slices of this path, of sound and of faulty teeth."""
    # imports FE modules that other cases do not need
    from flexgear.structures.tooth_influence.of_case import pair_bending
    from flexgear.structures.tooth_influence.rim import rim_bending

    assert path.slices is not None
    load = line_load(view, stage_geometry(view), path.kind.gear, force)
    compliance = pair_bending(view, path, path.slices, force)
    for member, part in enumerate(("planet", path.kind.gear)):
        if part in rims:
            compliance = compliance.with_rim(*rim_bending(rims[part], path, path.slices, member))
    nominal = NominalLoad(load / path.cos_base_helix, path.base_pitch)
    contact = (compliance.scale, compliance.limit)

    def couple(tooth_path: GearMeshPath, cracks: Array | None) -> GearMeshPath:
        assert tooth_path.slices is not None
        flexibility = compliance.flexibility if cracks is None else compliance.flexibility + cracks
        slices = with_flexibility(
            tooth_path.slices, flexibility, compliance.beside, contact, nominal
        )
        return replace(tooth_path, slices=slices)

    return couple


def _crack_flexibility(
    view: StageView, cracked: Sequence[Fault], path: GearMeshPath, lines: Slices
) -> Array:
    """Flexibility ΔC (S, K, K) of all cracks, m/N."""
    # imports FE modules that other cases do not need
    from flexgear.structures.tooth_influence.of_case import crack_flexibility

    return np.sum([crack_flexibility(view, path, lines, fault) for fault in cracked], axis=0)


def _faulty_paths(
    view: StageView,
    path: GearMeshPath,
    force: float,
    groups: FaultGroups,
    couple: Coupling | None,
    cracks: bool,
) -> Iterator[GearMeshPath]:
    """Paths of gear meshes of one kind, by groups of faults in the order of ``FaultGroups``.

    path: of sound teeth, with independent slices; force: of the gear mesh, N; couple: couples
    slices, None if they are independent; cracks: whether flexibilities of cracks are computed (half
    a minute each, cached).
    """
    for faults in groups.of_pairs:
        cracked = [f for _, f in faults if f.kind == "root_crack" and cracks]
        flexibility = partial(_crack_flexibility, view, cracked) if cracked else None
        if couple is None:
            yield with_faults(view, path, force, faults, flexibility)
            continue
        assert path.slices is not None
        delta = flexibility(path, path.slices) if flexibility else None
        yield couple(with_faults(view, path, force, faults, None), delta)


def has_coupled_slices(view: StageView) -> bool:
    """Whether FE influences couple the slices of tooth pairs of a stage."""
    options = view.gear_mesh
    return options.model == "face_load" and options.tooth_compliance == "fe"
