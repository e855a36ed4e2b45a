"""Frames of REXS components, bodies of components that rotate together, and torsional stiffness.

A component's support_vector and axes are given in the frame of the component that
reference_component_for_position names (usually the gear unit). A component without support_vector
is on its shaft at u_coordinate_on_shaft; a bearing or coupling at u_coordinate_on_shaft_inner_side
of its inner part, or likewise at its outer part.

Relations of type assembly connect a shaft with the parts on it. Relations of type side connect the
inner and outer part of couplings, fits, keys and splines. A carrier consists of shafts, pins and
side plates. Bearings do not connect parts in rotation. The body of the casing does not rotate.
"""

from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from math import pi

import numpy as np

from flexgear.arrays import Array
from flexgear.files.rexs.document import Component, Document, number, read, value, vector
from flexgear.files.rexs.tables import MATERIAL

_TOLERANCE = 1e-6  # of positions (mm) and of the length of a unit vector
_PARALLEL_TOLERANCE = 1e-6  # of 1 − cos of the angle between two axes: 1.4 mrad


@dataclass(frozen=True)
class Frame:
    """Origin (3,), mm, and axes (3, 3) with rows u, v, w of a frame, in the gear unit's frame."""

    origin: Array
    axes: Array


Placed = tuple[Component, Component | None, Frame | None]  # in the frame of the second


class Frames:
    """Frames of a document's components."""

    def __init__(self, document: Document) -> None:
        self.document = document
        mains = [*document.kind("gear_unit"), *document.kind("shaft")]
        main = next((m for m in mains if vector(m, "u_axis_vector")), None)
        axes = None if main is None else _axes(main)
        self._unit = Frame(np.zeros(3), np.eye(3) if axes is None else axes.T)
        self._frames: dict[int, Frame | None] = {}

    def of(self, component: Component) -> Frame | None:
        """Frame of a component, None if the file does not state its position."""
        chain: list[Placed] = []  # each in the frame of the next
        base: Component | None = component
        while base is not None and base.id not in self._frames:
            self._frames[base.id] = None  # ends circular references
            chain.append((base, *self._placed(base)))
            base = chain[-1][1]
        for positioned, base, local in reversed(chain):
            frame = None if base is None else self._frames[base.id]
            if frame is None and vector(positioned, "support_vector"):
                frame = self._unit
            if frame is not None and local is not None:
                origin = frame.origin + frame.axes.T @ local.origin
                self._frames[positioned.id] = Frame(origin, local.axes @ frame.axes)
        return self._frames[component.id]

    def sense(self, component: Component) -> float:
        """−1 if the u axis of a component's shaft opposes the u axis of the gear unit, else +1."""
        shaft = component if component.kind == "shaft" else self.shaft(component)
        frame = self.of(shaft) if shaft is not None else None
        return -1.0 if frame is not None and frame.axes[0, 0] < 0 else 1.0

    def is_parallel(self, component: Component) -> bool:
        """Whether the component's axis is parallel to the gear unit's; true if it has no axis."""
        frame = self.of(component)
        return frame is None or abs(float(frame.axes[0, 0])) > 1.0 - _PARALLEL_TOLERANCE

    def shaft(self, part: Component) -> Component | None:
        """The shaft on which a part is mounted, None if there is none."""
        return next((w for w in self.document.wholes(part) if w.kind == "shaft"), None)

    def _placed(self, component: Component) -> tuple[Component | None, Frame | None]:
        """Where the file states the position of a component: the component in whose axes it is,
        None for those of the gear unit; and the frame there, None without a stated position."""
        place = vector(component, "support_vector")
        if place is None:
            shaft, name = self._seat(component)
            along = None if shaft is None else number([component], name, "mm")
            local = None if along is None else Frame(np.array((along.value, 0.0, 0.0)), np.eye(3))
            return shaft, local
        axes = _axes(component)
        named = number([component], "reference_component_for_position", "none")
        other = None if named is None else self.document.components.get(round(named.value))
        if other is component or (other is not None and other.kind == "gear_unit"):
            other = None
        return other, Frame(np.array(place), np.eye(3) if axes is None else axes)

    def _seat(self, component: Component) -> tuple[Component | None, str]:
        """The shaft on which a component is, and the attribute with its position there."""
        for side in ("inner", "outer"):
            name = f"u_coordinate_on_shaft_{side}_side"
            part = (
                self.document.side_part(component, side) if name in component.attributes else None
            )
            if part is not None and part.kind == "shaft":
                return part, name
        return self.shaft(component), "u_coordinate_on_shaft"


def _axes(component: Component) -> Array | None:
    """Unit vectors u, v = w × u, w (3, 3) of a component's axes as rows; None without an axis."""
    u, w = vector(component, "u_axis_vector"), vector(component, "w_axis_vector")
    if u is None or np.linalg.norm(u) == 0:
        return None
    first = np.array(u) / np.linalg.norm(u)
    third = np.array((0.0, 0.0, 1.0) if w is None else w)
    third = third - (third @ first) * first
    if np.linalg.norm(third) < _TOLERANCE:
        third = np.cross(first, (0.0, 1.0, 0.0))
    third /= np.linalg.norm(third)
    return np.array([first, np.cross(third, first), third])


COUPLINGS = (
    "coupling", "switchable_coupling", "fixed_coupling", "cylindrical_interference_fit",
    "tapered_interference_fit", "feather_key_connection", "involute_spline_connection",
)  # fmt: skip
BEARINGS = (
    "concept_bearing", "rolling_bearing_with_catalog_geometry", "slide_bearing",
    "rolling_bearing_with_detailed_geometry", "hydrodynamic_radial_plain_bearing",
)  # fmt: skip
_ASSEMBLIES = ("shaft", "planet_carrier", "gear_casing", "ring_gear", "cylindrical_gear")
_SLICES = 8  # of a section, for the integral of 1/J


@dataclass(frozen=True)
class Link:
    """A connection of two components that rotate together.

    ends: their ids. at: positions of the connection along both, mm, None if unknown. compliance in
    torsion, rad/(N m). coupling: id of the coupling, None for rigid connections.
    """

    ends: tuple[int, int]
    at: tuple[float | None, float | None] = (None, None)
    compliance: float = 0.0
    coupling: int | None = None


Step = tuple[Link, int]  # a link and the index of the end at which the step arrives


class Assembly:
    """The bodies of a document: sets of components that rotate together. links: by the id of a
    component, the steps that leave it. casings: bodies of the casing, which do not rotate."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self.frames = Frames(document)
        self.links: dict[int, list[Step]] = {number: [] for number in document.components}
        self._link_parts()
        self._link_carriers()
        self._link_couplings()
        self._body: dict[int, int] = {}
        self._members: dict[int | None, list[Component]] = {}
        for component in document.components.values():
            if component.id not in self._body:
                self._body |= dict.fromkeys(self._steps_from(component.id), component.id)
            self._members.setdefault(self.body(component), []).append(component)
        self.casings = {self.body(casing) for casing in document.kind("gear_casing")}

    def body(self, component: Component) -> int:
        """Number of the component's body."""
        return self._body[component.id]

    def members(self, body: int | None) -> list[Component]:
        """Components of a body, in the order of the file."""
        return self._members.get(body, [])

    def held(self, component: Component) -> bool:
        """Whether a component is connected to the casing and therefore does not rotate."""
        return self.body(component) in self.casings

    def torsion(
        self, first: Component, second: Component, beyond: int = 0
    ) -> tuple[float, list[Component]]:
        """Torsional stiffness between two parts of a body and the couplings between them.

        The stiffness (N m/rad, inf if rigid) is that of the shaft sections and couplings along the
        shortest path in series, without the first ``beyond`` links and the sections between these.
        """
        path = self.path(first, second)[max(beyond - 1, 0) :]
        links = [link for link, _ in (path[1:] if beyond else path)]
        compliance = sum(link.compliance for link in links)
        for (before, k), (after, m) in pairwise(path):
            shaft = self.document.components[before.ends[k]]
            compliance += self._shaft_compliance(shaft, before.at[k], after.at[1 - m])
        ids = [link.coupling for link in links if link.coupling is not None]
        couplings = [self.document.components[number] for number in ids]
        return 1.0 / compliance if compliance > 0 else float("inf"), couplings

    def path_length(self, first: Component, second: Component) -> tuple[int, float]:
        """Number of links between two parts of a body, and the difference of their positions on
        the shaft, mm."""
        positions = [value(c, "u_coordinate_on_shaft", "mm") for c in (first, second)]
        return len(self.path(first, second)), abs(positions[0] - positions[1])

    def _steps_from(self, first: int) -> dict[int, Step | None]:
        """Last step of the shortest path from a component to each component of its body, by id.

        The components are in breadth-first order; the step of the first component is None.
        """
        steps: dict[int, Step | None] = {first: None}
        queue = deque([first])
        while queue:
            for link, k in self.links[queue.popleft()]:
                if link.ends[k] not in steps:
                    steps[link.ends[k]] = link, k
                    queue.append(link.ends[k])
        return steps

    def path(self, first: Component, second: Component) -> list[Step]:
        """Steps of the shortest path from one component of a body to another."""
        steps, path = self._steps_from(first.id), []
        step = steps[second.id]
        while step is not None:
            path.append(step)
            step = steps[step[0].ends[1 - step[1]]]
        return path[::-1]

    def _shaft_compliance(self, shaft: Component, a: float | None, b: float | None) -> float:
        """Torsional compliance ∫ du/(G J) of a shaft between u = a and u = b (mm), rad/(N m)."""
        if shaft.kind != "shaft" or a is None or b is None or a == b:
            return 0.0
        modulus = self._shear_modulus(shaft)
        total, low, high = 0.0, min(a, b), max(a, b)
        for _, section in sections_of(self.document, shaft):
            start, end = max(low, section.start), min(high, section.start + section.length)
            for k in range(_SLICES if end > start else 0):
                step = (end - start) / _SLICES
                outer, inner = section.diameters(start + (k + 0.5) * step)
                polar = pi / 32 * (outer**4 - inner**4) * 1e-12  # mm⁴ to m⁴
                total += step * 1e-3 / (modulus * polar) if polar > 0 else 0.0
        return total

    def _shear_modulus(self, shaft: Component) -> float:
        """Shear modulus E/(2 (1 + ν)) of a shaft, Pa."""
        materials = self.document.references(shaft, "material")
        data = [(row.usual, read(materials, row)) for row in MATERIAL[:2]]
        young, poisson = (usual if datum is None else datum.value for usual, datum in data)
        ratio = poisson if poisson < 0.5 else MATERIAL[1].usual
        return 1e9 * young / (2.0 * (1.0 + ratio))

    def _link_parts(self) -> None:
        for relation in self.document.related("assembly"):
            whole, part = self.document.at(relation, "assembly"), self.document.at(relation, "part")
            relation.used |= whole is not None and whole.kind == "gear_unit"
            if whole is None or part is None or whole.kind not in _ASSEMBLIES:
                continue
            self._add_link(Link((whole.id, part.id), (self._position_on(whole, part), None)))
            relation.used = True

    def _position_on(self, shaft: Component, part: Component) -> float | None:
        """Position of a part along its shaft, mm from the start of the shaft, None if unknown.

        Some files state the start of a gear's face as u_coordinate_on_shaft. If the part's frame
        differs from that coordinate, the frame is used, whose origin is the middle of the gear.
        """
        stated = number([part], "u_coordinate_on_shaft", "mm")
        frame, base = self.frames.of(part), self.frames.of(shaft)
        if frame is None or base is None:
            return None if stated is None else stated.value
        u = float((frame.origin - base.origin) @ base.axes[0])
        return u if stated is None or abs(stated.value - u) > _TOLERANCE else stated.value

    def _link_carriers(self) -> None:
        """Link the frame, shafts and pins of each carrier."""
        for stage in self.document.kind("planetary_stage"):
            parts = carrier_parts(self.document, stage)
            for part in parts[1:]:
                self._add_link(Link((parts[0].id, part.id)))

    def _link_couplings(self) -> None:
        for relation, joint, (inner, outer) in self.document.joints(*COUPLINGS):
            engaged = self._engaged(joint)
            stiffness = number([joint], "rotational_stiffness", "N m / rad")
            if not engaged or (stiffness is not None and stiffness.value <= 0):
                continue
            at = [
                None if place is None else place.value
                for side in ("inner", "outer")
                for place in [number([joint], f"u_coordinate_on_shaft_{side}_side", "mm")]
            ]
            compliance = 0.0 if stiffness is None else 1.0 / stiffness.value
            self._add_link(Link((inner.id, outer.id), (at[0], at[1]), compliance, joint.id))
            relation.used, joint.role = True, "a joint"

    def _engaged(self, joint: Component) -> bool:
        """Whether a coupling is closed in the gear step to which the gear unit is shifted."""
        attribute = joint.attributes.get("is_engaged")
        if attribute is None or attribute.value is None:
            return True
        attribute.used = True
        states = attribute.value if isinstance(attribute.value, tuple) else (attribute.value,)
        shifted = number(self.document.kind("gear_unit"), "gear_shift_index", "none")
        index = 0 if shifted is None else int(shifted.value) - 1
        state = states[index] if 0 <= index < len(states) else next(iter(states), "true")
        return state.strip().lower() not in ("false", "0")

    def _add_link(self, link: Link) -> None:
        for k, end in enumerate(link.ends):
            self.links[end].append((link, 1 - k))
            part = self.document.components[end]
            part.role = part.role or ("a part of a body" if part.kind == "shaft" else "")


def carrier_parts(document: Document, stage: Component) -> list[Component]:
    """Frame, shafts and pins of the carrier of a planetary stage."""
    kinds = ("planet_carrier_shaft", "planet_pin")
    shafts = document.linked(stage, "planetary_stage", "shaft", *kinds)
    return [*document.parts(stage, "planet_carrier"), *shafts]


@dataclass(frozen=True)
class ShaftSection:
    """A shaft section: start on the shaft, length, diameters at both ends; all in mm."""

    start: float
    length: float
    outer: tuple[float, float]
    inner: tuple[float, float]

    def diameters(self, u: float) -> tuple[float, float]:
        """Outer and inner diameter at the position u of the shaft, linear between the ends."""
        share = (u - self.start) / self.length
        outer, inner = (a + share * (b - a) for a, b in (self.outer, self.inner))
        return outer, inner


def sections_of(document: Document, shaft: Component) -> list[tuple[Component, ShaftSection]]:
    """Sections of a shaft that have a length and a diameter, each with its component. A diameter
    that is missing at one end is that of the other end."""
    sections = []
    for part in document.parts(shaft, "shaft_section"):
        length, start = value(part, "length", "mm"), value(part, "u_coordinate_on_shaft", "mm")
        outer, inner = (
            (value(part, (f"{name}_begin", f"{name}_end"), "mm"),
             value(part, (f"{name}_end", f"{name}_begin"), "mm"))
            for name in ("outer_diameter", "inner_diameter")
        )  # fmt: skip
        if length > 0 and outer[0] > 0:
            part.role = "a section"
            sections.append((part, ShaftSection(start, length, outer, inner)))
    return sections
