"""Content of a REXS file: components with attributes, relations between them, load cases.

Attributes and relations are marked when they are used for the case, so that all others can be
listed.
"""

import math
from collections.abc import Container, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from flexgear.files.case_text import Datum
from flexgear.files.rexs.tables import SCHEMA_UNITS, Row, factor, without_rounding
from flexgear.model.errors import InputError, echo

SAME = 1e-9  # relative difference of two numbers that count as equal
_LARGEST = 1e60  # of a number, so that its fourth power does not overflow
_NAME_LENGTH = 40  # of a component's name in comments


@dataclass(eq=False)
class Attribute:
    """An attribute of a component.

    value: text of a scalar, texts of an array, None for other types such as matrices. where: name
    of its load case, "" for the model itself. used: whether the case has a key from it.
    unknown_unit: whether a case needs it in a unit to which its unit cannot be converted.
    """

    id: str
    unit: str
    value: str | tuple[str, ...] | None
    where: str = ""
    used: bool = False
    unknown_unit: bool = False


@dataclass(eq=False)
class Component:
    """A component: id, type and name in the file, attributes by id.

    role: the part of the case that it describes, "" if there is none. of_model: attributes of the
    model itself; in ``attributes`` those of the selected load case replace them.
    """

    id: int
    kind: str
    name: str
    of_model: dict[str, Attribute] = field(default_factory=dict)
    role: str = ""

    def __post_init__(self) -> None:
        self.attributes = self.of_model

    @property
    def label(self) -> str:
        """Type, id and name for comments, without unprintable characters."""
        name = " ".join("".join(c if c.isprintable() else " " for c in self.name).split())
        name = name if len(name) <= _NAME_LENGTH else f"{name[: _NAME_LENGTH - 1]}…"
        return f"{self.kind} {self.id}" + (f' "{name}"' if name else "")


@dataclass(eq=False)
class Relation:
    """A relation: its type, and the id of the component in each role. Of several components in the
    same role, the first is taken."""

    id: int
    kind: str
    refs: dict[str, int]
    used: bool = False


@dataclass
class LoadCase:
    """Attributes of components in one load case, as pairs of component id and attribute. name: an
    attribute of the element, which the format allows and flexgear writes; "" without."""

    spectrum: int
    id: int
    attributes: list[tuple[int, Attribute]]
    name: str = ""


Links = dict[int | None, list[tuple[Relation, Component]]]


@dataclass
class Document:
    """A REXS model. other: descriptions of further content, which is listed as not imported.

    There may be hundreds of thousands of components and relations, so the results of searches by
    type are stored.
    """

    version: str
    application: str
    components: dict[int, Component]
    relations: list[Relation]
    load_cases: list[LoadCase] = field(default_factory=list)
    other: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.load_case: LoadCase | None = None
        self._components: dict[tuple[str, ...], list[Component]] = {}
        self._relations: dict[tuple[str, ...], list[Relation]] = {}
        self._links: dict[tuple[str, ...], Links] = {}

    def kind(self, *kinds: str) -> list[Component]:
        """Components of these types, in the order of the file."""
        if kinds not in self._components:
            self._components[kinds] = [c for c in self.components.values() if c.kind in kinds]
        return self._components[kinds]

    def related(self, *kinds: str) -> list[Relation]:
        """Relations of these types, in the order of the file."""
        if kinds not in self._relations:
            self._relations[kinds] = [r for r in self.relations if r.kind in kinds]
        return self._relations[kinds]

    def at(self, relation: Relation, role: str) -> Component | None:
        """The component in a role of a relation, None if there is none."""
        number = relation.refs.get(role)
        return None if number is None else self.components.get(number)

    def parts(self, whole: Component, *kinds: str) -> list[Component]:
        """Sub-components of these types of a component."""
        links = self._linked("assembly", "part", "assembly", "ordered_assembly")
        return _used(links.get(whole.id, ()), kinds)

    def wholes(self, part: Component) -> list[Component]:
        """Components that a component is assembled to."""
        return [whole for _, whole in self._linked("part", "assembly", "assembly").get(part.id, ())]

    def side_part(self, joint: Component, side: str) -> Component | None:
        """The "inner" or "outer" part of a bearing or coupling."""
        links = self._linked("assembly", f"{side}_part", "side").get(joint.id, ())
        return next((part for _, part in links), None)

    def references(self, origin: Component, *kinds: str) -> list[Component]:
        """Components of these types that ``origin`` refers to."""
        links = self._linked("origin", "referenced", "reference", "ordered_reference")
        return _used(links.get(origin.id, ()), kinds)

    def linked(self, origin: Component, role: str, target: str, *kinds: str) -> list[Component]:
        """Components in the role ``target`` of relations of these types in which ``origin`` has the
        role ``role``."""
        return _used(self._linked(role, target, *kinds).get(origin.id, ()))

    def each(self, kind: str, *roles: str) -> Iterator[tuple[Relation, list[Component]]]:
        """Relations of a type that have all these roles, each with the components in the roles."""
        for relation in self.related(kind):
            components = [c for role in roles if (c := self.at(relation, role)) is not None]
            if len(components) == len(roles):
                yield relation, components

    def joints(
        self, *kinds: str
    ) -> Iterator[tuple[Relation, Component, tuple[Component, Component]]]:
        """Bearings and couplings of these types, each with its relation, inner and outer part."""
        ends = ("inner_part", "outer_part")
        for relation, (joint, inner, outer) in self.each("side", "assembly", *ends):
            if joint.kind in kinds:
                yield relation, joint, (inner, outer)

    def _linked(self, role: str, target: str, *kinds: str) -> Links:
        """Relations of these types, each with its component in the role ``target``, by the id of
        the component in ``role``."""
        key = (role, target, *kinds)
        if key not in self._links:
            links = self._links[key] = {}
            for relation in self.related(*kinds):
                component = self.at(relation, target)
                if component is not None:
                    links.setdefault(relation.refs.get(role), []).append((relation, component))
        return self._links[key]

    def take_load_case(self, load_case: LoadCase | None) -> None:
        """Replace attributes of the model by those of a load case; None restores the model's."""
        for number, _ in () if self.load_case is None else self.load_case.attributes:
            self.components[number].attributes = self.components[number].of_model
        for number, attribute in () if load_case is None else load_case.attributes:
            component = self.components[number]
            component.attributes = component.attributes | {attribute.id: attribute}
        self.load_case = load_case

    @contextmanager
    def values_of(self, load_case: LoadCase | None) -> Iterator[None]:
        """Select another load case inside the block."""
        previous = self.load_case
        self.take_load_case(load_case)
        try:
            yield
        finally:
            self.take_load_case(previous)


def _used(
    links: Iterable[tuple[Relation, Component]], kinds: Container[str] | None = None
) -> list[Component]:
    """Mark relations with components of these types (None: all) as used; returns the components."""
    components = []
    for relation, component in links:
        if kinds is None or component.kind in kinds:
            relation.used = True
            components.append(component)
    return components


def mark(components: Iterable[Component], role: str) -> None:
    """Record on each REXS component the part of the case that it became, such as "the carrier";
    components without a record are listed as not imported."""
    for component in components:
        component.role = role


def number(
    components: Sequence[Component], ids: str | Iterable[str], unit: str, positive: bool = False
) -> Datum | None:
    """The first attribute of ``ids`` that any of the components has, in ``unit``; None without one.

    The components describe the same part (both flanks, all planets). The value of the first one is
    taken, and equal values of the others are marked as used. Values in a unit that cannot be
    converted remain unused; if only positive values count, others are as if missing.
    """
    for name in (ids,) if isinstance(ids, str) else ids:
        values = [(c, x) for c in components if (x := _converted(c, name, unit)) is not None]
        if positive:
            values = [(c, x) for c, x in values if x > 0]
        if not values:
            continue
        component, first = values[0]
        for twin, other in values:
            if math.isclose(other, first, rel_tol=SAME, abs_tol=SAME):
                twin.attributes[name].used = True
        where = component.attributes[name].where
        return Datum(first, ", ".join(filter(None, (component.label, name, where))))
    return None


def read(components: Sequence[Component], row: Row) -> Datum | None:
    """Value of a case's field from the attributes of components, in the field's unit, or None."""
    return number(components, row.names, row.unit, row.positive)


def mean(
    components: Sequence[Component],
    names: Iterable[str | Iterable[str]],
    unit: str,
    positive: bool = False,
) -> Datum | None:
    """Mean of the attributes ``names`` that the file has; None without any. positive: whether only
    values above 0 count; several names in place of one are alternatives, as for ``number``."""
    data = [d for name in names if (d := number(components, name, unit, positive)) is not None]
    if not data:
        return None
    source = " and ".join(d.source for d in data) + ", mean" * (len(data) > 1)
    return Datum(sum(d.value for d in data) / len(data), source)


def value(component: Component, names: str | Iterable[str], unit: str) -> float:
    """The value of the first of these attributes in ``unit``, 0 if the file has none."""
    datum = number([component], names, unit)
    return 0.0 if datum is None else datum.value


def text(components: Sequence[Component], name: str) -> str | None:
    """Text of an attribute (enumeration, boolean, name) of the first component that has it."""
    attributes = [a for c in components if (a := c.attributes.get(name)) is not None]
    first = next((a.value for a in attributes if isinstance(a.value, str)), None)
    for attribute in attributes if first is not None else ():
        attribute.used |= attribute.value == first
    return None if first is None else first.strip()


def flag(components: Sequence[Component], name: str) -> bool | None:
    """A boolean attribute, None if the file does not have it."""
    word = text(components, name)
    return None if word is None else word.lower() in ("true", "1", "1.0")


def vector(component: Component, name: str) -> tuple[float, float, float] | None:
    """An attribute with three components, lengths in mm; None if the file does not have it. Raises
    InputError for a component that is not finite or is too large."""
    attribute = component.attributes.get(name)
    if attribute is None or not isinstance(attribute.value, tuple) or len(attribute.value) != 3:
        return None
    scale = factor(attribute.unit or SCHEMA_UNITS.get(name, ""), "mm")
    try:
        x, y, z = (float(v) * (1.0 if scale is None else scale) for v in attribute.value)
    except ValueError:
        return None
    if not all(abs(v) < _LARGEST for v in (x, y, z)):
        problem = f"{echo(' '.join(attribute.value))} is no position or direction"
        raise InputError(component.label, name, problem, "export the model again")
    attribute.used = True
    return x, y, z


def _converted(component: Component, name: str, unit: str) -> float | None:
    attribute = component.attributes.get(name)
    if attribute is None or not isinstance(attribute.value, str):
        return None
    unit_text = attribute.unit.strip()
    if unit_text in ("", "none"):
        unit_text = SCHEMA_UNITS.get(name, unit_text)
    scale = factor(unit_text, unit)
    attribute.unknown_unit = scale is None
    try:
        value = float(attribute.value)
    except ValueError:
        return None
    if scale is None or not abs(value) < _LARGEST:
        return None
    return value if scale == 1.0 else without_rounding(value * scale)
