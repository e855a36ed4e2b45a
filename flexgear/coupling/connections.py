"""Who touches whom: all springs of a stage between ports of its bodies, read from the case once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.bearings import linear_part
from flexgear.coupling.members import body_names, reference_radius
from flexgear.gears.radii import stage_radii
from flexgear.model.member import Support
from flexgear.model.names import BodyName, MemberName, SupportName
from flexgear.model.springs import Bearing
from flexgear.model.stage_view import StageView
from flexgear.structures.sources.of_case import ring_source

Array = NDArray[np.float64]
End = tuple[BodyName, str]  # a body and one of its ports


@dataclass(frozen=True)
class Connection:
    """A spring between two ports: force = matrix @ (motion of the first − motion of the second).

    name: of its link, and of the node of an FE housing on which it stands; second: None for the
    housing; matrix: (6, 6) SI; axes: angle of the axes in which it acts, rad; kind: see ``Link``;
    frame: of the first port, turning against the housing, "" where it stands; bearing: that acts
    beside the spring by a law of its own, if it has one, of the first body on the housing or of the
    second on the first; reaches: the second body reaches rigidly to where the first port is; key:
    of the spring in the case, where that can be wrong.
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


def connections(view: StageView) -> Iterator[Connection]:
    """All springs of a stage; InputError for those with which it could not roll or hold."""
    stage, forms = view.stage, {"lumped": _of_lumped, "beam": _of_shaft}
    of_bodies = {"ring": _of_fe_ring, "carrier": _of_seats}
    for part in stage.members:
        yield from (forms.get(stage.form(part)) or of_bodies[part])(view, part)
    if stage.kind == "planetary":
        yield from _of_planets(view)
    yield from _of_hub(view)
    yield from _behind_spline(view)


def spline_matrix(view: StageView) -> Array:
    """Stiffness (6, 6) of the spline at the end of the sun's shaft, SI."""
    return np.diag(np.asarray(view.shaft.spline.stiffness, dtype=float))


def _support_matrix(support: Support, radius: float) -> Array:
    """Stiffness (6, 6) of a support with its tangential spring as torsion k r², SI."""
    matrix = np.array(support.matrix, dtype=float)
    matrix[5, 5] += support.tangential * radius**2
    return matrix


def _of_lumped(view: StageView, part: str) -> Iterator[Connection]:
    """Support of each body of a lumped member: of both halves of a double-helical ring."""
    support = view.stage.member(part).support
    radius = reference_radius(view.stage, part, stage_radii(view))
    matrix = linear_part(support, _support_matrix(support, radius))
    for body in body_names(view.stage, part):
        place = SupportName.of(body, "support")
        yield from _held(place, (body, "gear"), matrix, view.key(f"{part}.support"), support)


def _of_shaft(view: StageView, part: str) -> Iterator[Connection]:
    """The spline of a sun that is held, and its support at the gear."""
    sun, shaft = MemberName.of(view.name, part), BodyName.of(view.name, "shaft")
    if sun in view.case.held_members():
        place = SupportName.of(f"{view.name}.spline")
        key = view.key("sun.shaft.spline")
        yield from _held(place, (shaft, "spline"), spline_matrix(view), key)
    support = view.stage.member(part).support
    if support.matrix.any():
        radius = reference_radius(view.stage, part, stage_radii(view))
        matrix = linear_part(support, _support_matrix(support, radius))
        key = view.key(f"{part}.support")
        yield from _held(SupportName.of(sun), (shaft, "gear"), matrix, key, support)


def _of_fe_ring(view: StageView, part: str) -> Iterator[Connection]:
    """Bolts, fits and splines on the housing where the ring is held, else on the hub with which it
    turns."""
    ring, hub = BodyName.of(view.name, part), (BodyName.of(view.name, "hub"), "end")
    held = MemberName.of(view.name, part) in view.case.held_members()
    for spring in ring_source(view).springs:
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
    carrier, bearings = BodyName.of(view.name, part), view.seat_bearings
    held = MemberName.of(view.name, part) in view.case.held_members()
    if held and not any(bearing.stiffness[5] for bearing in bearings.values()):
        raise view.refuse(
            "carrier.bearing_drive.torsion_nm_per_rad",
            f"is zero, so nothing takes the torque of the held {carrier}",
            "give it, or that of bearing_far",
        )
    for side, bearing in bearings.items():
        place = SupportName.of(f"{carrier}_{side}")
        seat, key = (carrier, f"bearing_{side}"), view.key(f"carrier.bearing_{side}")
        yield _bearing(place, seat, bearing, "carrier", key)


def _of_planets(view: StageView) -> Iterator[Connection]:
    """Bearings of planets on the pins of their carrier, in each planet's axes."""
    bearing, carrier = view.stage.planet_bearing, BodyName.of(view.name, "carrier")
    if np.any(bearing.matrix[5] != 0):
        raise view.refuse(
            "planet_bearing",
            "holds the planet's rotation about its axis, so the gears could not roll",
            "set the stiffness about z (torsion, row 6) to zero",
        )
    matrix = linear_part(bearing, _support_matrix(bearing, 0.0))
    for number, planet in enumerate(body_names(view.stage, "planet"), 1):
        yield Connection(
            SupportName.of(f"{view.name}.planet_bearing_{number}"),
            (carrier, f"pin_{number}"),
            (planet, "bore"),
            matrix,
            kind="planet_bearing",
            bearing=bearing,
        )


def _of_hub(view: StageView) -> Iterator[Connection]:
    """The bearing of what an FE ring that turns is held on."""
    hub = view.stage.ring.hub if view.stage.ring is not None else None
    held = MemberName.of(view.name, "ring") in view.case.held_members()
    if hub is not None and hub.bearing is not None and not held:
        body = BodyName.of(view.name, "hub")
        key = view.key("ring.hub.bearing")
        yield _bearing(SupportName.of(body), (body, "end"), hub.bearing, "ring", key)


def _behind_spline(view: StageView) -> Iterator[Connection]:
    """The spline between a sun's shaft and what hangs behind it, and the bearing of that."""
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
    """A bearing on the housing: its linear part, and what has a law of its own."""
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
