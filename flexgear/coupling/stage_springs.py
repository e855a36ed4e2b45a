"""All springs of a stage: what holds each member on the housing, on its hub and on its pins."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexgear.coupling.assembly import Assembly
from flexgear.coupling.bearings import linear_part, own_law
from flexgear.coupling.members import Member
from flexgear.coupling.rotor_terms import planet_axes
from flexgear.coupling.system import StageFrame
from flexgear.gears.radii import stage_radii
from flexgear.model.errors import InputError
from flexgear.model.member import Support
from flexgear.model.names import MemberName, SupportName
from flexgear.model.springs import Bearing
from flexgear.model.stage_view import StageView
from flexgear.structures.kinematics import rigid_rows, turn
from flexgear.structures.sources.of_case import ring_source

Array = NDArray[np.float64]


def tie_stage(a: Assembly, view: StageView, members: list[Member], frame: StageFrame) -> None:
    """Enter all springs of a stage."""
    tie = {"planet": _tie_planet, "hub": _tie_hub, "output": _tie_output}
    by_form = {("ring", "fe"): _tie_fe_ring, ("carrier", "fe"): _tie_fe_carrier}
    by_form[("sun", "beam")] = _tie_shaft
    for m in members:
        (by_form.get((m.part, m.form)) or tie.get(m.part, _tie_lumped))(a, view, m, frame)


def support_matrix(support: Support, radius: float) -> Array:
    """Stiffness (6, 6) of a support with its tangential spring as torsion k r², SI."""
    matrix = np.array(support.matrix, dtype=float)
    matrix[5, 5] += support.tangential * radius**2
    return matrix


def spline_matrix(view: StageView) -> Array:
    """Stiffness (6, 6) of the spline at the end of the sun's shaft, SI."""
    return np.diag(np.asarray(view.shaft.spline.stiffness, dtype=float))


def _tie_lumped(a: Assembly, view: StageView, m: Member, frame: StageFrame) -> None:
    name, support = m.body.name, view.stage.member(m.part).support
    matrix = linear_part(support, support_matrix(support, m.radius))
    axes = planet_axes(view.stage, m)
    place = SupportName.of(name, "support")
    _hold(a, place, (name, name), matrix, frame.carrier, axes)
    _obey(a, place, (name, name), support, frame.carrier, axes)


def _tie_planet(a: Assembly, view: StageView, m: Member, frame: StageFrame) -> None:
    bearing, name = view.stage.planet_bearing, f"{view.name}.planet_bearing_{m.planet + 1}"
    if np.any(bearing.matrix[5] != 0):
        raise InputError(
            a.source,
            view.key("planet_bearing"),
            "holds the planet's rotation about its axis, so the gears could not roll",
            "set the stiffness about z (torsion, row 6) to zero",
        )
    pin, planet = pin_rows(a, view, m.planet), a.rows(m.body.name, m.node)
    matrix = linear_part(bearing, support_matrix(bearing, 0.0))
    a.link(name, pin - planet, matrix, "planet_bearing")
    a.law_bearing(name, planet, pin, bearing)


def pin_rows(a: Assembly, view: StageView, planet: int) -> Array:
    """Motion (6, d) of a pin's middle in its planet's axes."""
    phi, carrier = view.stage.planet_angles[planet], f"{view.name}.carrier"
    if view.stage.form("carrier") == "fe":
        return np.asarray(turn(-phi) @ a.rows(carrier, f"pin_{planet + 1}"))
    radius, centre = stage_radii(view).center_distance, np.eye(6)
    centre[1, 5], centre[2, 4] = radius, -radius
    return np.asarray(centre @ turn(-phi) @ a.rows(carrier, carrier))


def _tie_fe_ring(a: Assembly, view: StageView, m: Member, frame: StageFrame) -> None:
    """On the housing where the ring is held; where it turns on its hub, in the ring's frame."""
    hub = f"{view.name}.hub"
    for spring in ring_source(view).springs:
        place, name = m.body.position(spring.node), SupportName.of(f"{view.name}.{spring.node}")
        if a.has(hub):
            under = rigid_rows(place, a.body(hub).position(hub))[:6] @ a.rows(hub, hub)
        else:
            under = a.housing_rows(name, place)
        node = a.rows(m.body.name, spring.node) - under
        a.link(name, spring.axes @ node, spring.matrix, spring.node.kind)


def _tie_fe_carrier(a: Assembly, view: StageView, m: Member, frame: StageFrame) -> None:
    bearings = view.seat_bearings
    if frame.carrier < 0 and not any(bearing.stiffness[5] for bearing in bearings.values()):
        raise InputError(
            a.source, view.key("carrier.bearing_drive.torsion_nm_per_rad"),
            f"is zero, so nothing takes the torque of the held {m.body.name}",
            "give it, or that of bearing_far",
        )  # fmt: skip
    for side, bearing in bearings.items():
        node = (m.body.name, f"bearing_{side}")
        place = SupportName.of(f"{view.name}.carrier_{side}")
        _bear(a, place, node, bearing, frame.carrier)


def _tie_hub(a: Assembly, view: StageView, m: Member, frame: StageFrame) -> None:
    hub = view.stage.ring.hub if view.stage.ring else None
    if hub is not None and hub.bearing is not None:
        name = m.body.name
        _bear(a, SupportName.of(name), (name, m.node), hub.bearing, frame.ring)


def _tie_shaft(a: Assembly, view: StageView, m: Member, frame: StageFrame) -> None:
    sun = MemberName.of(view.name, "sun")
    if sun in view.case.held_members():
        spline = SupportName.of(f"{view.name}.spline")
        _hold(a, spline, (m.body.name, "end"), spline_matrix(view), frame.carrier)
    support = view.stage.member("sun").support
    if support.matrix.any():
        matrix = linear_part(support, support_matrix(support, m.radius))
        place = SupportName.of(sun)
        _hold(a, place, (m.body.name, "sun"), matrix, frame.carrier)
        _obey(a, place, (m.body.name, "sun"), support, frame.carrier)


def _tie_output(a: Assembly, view: StageView, m: Member, frame: StageFrame) -> None:
    shaft, output = a.rows(f"{view.name}.shaft", "end"), a.rows(m.body.name, m.node)
    a.link(f"{view.name}.spline", shaft - output, spline_matrix(view))
    port = view.case.port_at(f"{view.name}.sun")
    if port is not None and port.bearing is not None:
        place = SupportName.of(m.body.name)
        _bear(a, place, (m.body.name, m.node), port.bearing, frame.carrier)


def _bear(
    a: Assembly, name: SupportName, node: tuple[str, str], bearing: Bearing, angle: int
) -> None:
    """A bearing of a node on the housing: its linear part, and what has a law of its own."""
    _support(a, name, node, linear_part(bearing, bearing.matrix), angle)
    _obey(a, name, node, bearing, angle)


def _obey(
    a: Assembly,
    name: SupportName,
    node: tuple[str, str],
    bearing: Bearing,
    angle: int,
    axes: float = 0.0,
) -> None:
    """What of a bearing on the housing has a law of its own; axes: see ``_support``."""
    if own_law(bearing) is None:
        return
    housing = a.housing_rows(name, a.body(node[0]).position(node[1]))
    a.law_bearing(name, turn(axes) @ a.rows(*node), housing, bearing, angle)


def _hold(
    a: Assembly,
    name: SupportName,
    node: tuple[str, str],
    matrix: Array,
    angle: int,
    axes: float = 0.0,
) -> None:
    """A support that may resist rotation about the axis, which is the same in any frame."""
    torsion, rest = np.zeros((6, 6)), np.array(matrix)
    torsion[5, 5], rest[5, 5] = matrix[5, 5], 0.0
    _support(a, SupportName.of(name.place, "torsion"), node, torsion, -1)
    if rest.any():
        _support(a, name, node, rest, angle, axes)


def _support(
    a: Assembly,
    name: SupportName,
    node: tuple[str, str],
    matrix: Array,
    angle: int,
    axes: float = 0.0,
) -> None:
    """A spring of a node to the housing; angle: that of the node's frame, −1 where it stands.

    axes: constant angle of the node's axes there, rad, as the gear of a parallel stage has it; the
    spring is in fixed axes. Nothing stands where there is no spring.
    """
    if not np.any(matrix):
        return
    if angle >= 0:
        a.rotating_frame_support(name, *node, matrix, angle)
    else:
        housing = a.housing_rows(name, a.body(node[0]).position(node[1]))
        a.link(name, turn(axes) @ a.rows(*node) - housing, matrix)
