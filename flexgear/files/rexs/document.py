"""What stands in a REXS file: components with attributes, relations between them, load cases.

Every attribute remembers whether something of the case came from it, so that the rest can be
listed: nothing of a file is dropped unseen.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, TypeVar

from flexgear.files.case_text import Datum
from flexgear.files.rexs.tables import SCHEMA_UNITS, Row, factor
from flexgear.model.errors import InputError, echo

SAME = 1e-9  # relative difference of two numbers that say the same
_LARGEST = 1e60  # of a number, so that its fourth power is one, too
_SHOWN = 40  # characters of a component's name in comments


@dataclass(eq=False)
class Attribute:
    """One attribute as text (scalar), texts (array), or None for other types such as matrices.

    where: load case that it belongs to, "" for the model itself. used: whether it is carried over.
    """

    id: str
    unit: str
    value: str | tuple[str, ...] | None
    where: str = ""
    used: bool = False


@dataclass(eq=False)
class Component:
    """A component: type, number and name of the file, attributes by id.

    role: what it became in the case, "" for one that stands for nothing there. of_model: attributes
    of the model itself, in whose place ``attributes`` has those of the load case that is taken.
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
        """Type, id and name, printable."""
        name = " ".join("".join(c if c.isprintable() else " " for c in self.name).split())
        name = name if len(name) <= _SHOWN else f"{name[: _SHOWN - 1]}…"
        return f"{self.kind} {self.id}" + (f' "{name}"' if name else "")


@dataclass(eq=False)
class Relation:
    """A relation of a REXS file: its type, and the id of the component in each role, the first
    where a role stands there several times."""

    id: int
    kind: str
    refs: dict[str, int]
    used: bool = False


@dataclass
class LoadCase:
    """Attributes of components in one load case, (component's id, attribute)."""

    spectrum: int
    id: int
    attributes: list[tuple[int, Attribute]]


Item = TypeVar("Item", Component, Relation)
Links = dict[int | None, list[tuple[Relation, Component]]]


@dataclass
class Document:
    """A REXS model. ``other``: what stands in it besides, in words, to be listed.

    Components and relations are looked up by kind and by what they belong to; there may be hundreds
    of thousands, so that each such list is made once.
    """

    version: str
    application: str
    components: dict[int, Component]
    relations: list[Relation]
    load_cases: list[LoadCase] = field(default_factory=list)
    other: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.load_case: LoadCase | None = None
        self._lists: dict[tuple[type, tuple[str, ...]], list[Any]] = {}
        self._links: dict[tuple[str, ...], Links] = {}

    def kind(self, *kinds: str) -> list[Component]:
        """Components of these types, in the order of the file."""
        return self._listed(Component, self.components.values(), kinds)

    def related(self, *kinds: str) -> list[Relation]:
        """Relations of these types, in the order of the file."""
        return self._listed(Relation, self.relations, kinds)

    def at(self, relation: Relation, role: str) -> Component | None:
        """The component in a role of a relation."""
        number = relation.refs.get(role)
        return None if number is None else self.components.get(number)

    def parts(self, whole: Component, *kinds: str) -> list[Component]:
        """Sub-components of these types of a component."""
        links = self._linked("assembly", "part", "assembly", "ordered_assembly")
        return _used(links.get(whole.id, ()), kinds)

    def wholes(self, part: Component) -> list[Component]:
        """Components that a component is assembled to."""
        return [whole for _, whole in self._linked("part", "assembly", "assembly").get(part.id, ())]

    def references(self, origin: Component, *kinds: str) -> list[Component]:
        """Components of these types that ``origin`` refers to."""
        links = self._linked("origin", "referenced", "reference", "ordered_reference")
        return _used(links.get(origin.id, ()), kinds)

    def linked(self, origin: Component, role: str, target: str, *kinds: str) -> list[Component]:
        """Components in the role ``target`` of relations of these types in which ``origin`` has the
        role ``role``."""
        return _used(self._linked(role, target, *kinds).get(origin.id, ()))

    def each(self, kind: str, *roles: str) -> Iterator[tuple[Relation, list[Component]]]:
        """Relations of a type, each with the components in these roles, where all are there."""
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

    def _listed(self, of: type[Item], items: Iterable[Item], kinds: tuple[str, ...]) -> list[Item]:
        if (of, kinds) not in self._lists:
            self._lists[of, kinds] = [item for item in items if item.kind in kinds]
        return self._lists[of, kinds]

    def _linked(self, role: str, target: str, *kinds: str) -> Links:
        """Relations of these types and the component in a role, by the id in the other ``role``."""
        key = (role, target, *kinds)
        if key not in self._links:
            links = self._links[key] = {}
            for relation in self.related(*kinds):
                component = self.at(relation, target)
                if component is not None:
                    links.setdefault(relation.refs.get(role), []).append((relation, component))
        return self._links[key]

    def take_load_case(self, load_case: LoadCase | None) -> None:
        """Give components the attributes of a load case in place of the model's; None: those of the
        model."""
        for number, _ in () if self.load_case is None else self.load_case.attributes:
            self.components[number].attributes = self.components[number].of_model
        for number, attribute in () if load_case is None else load_case.attributes:
            component = self.components[number]
            component.attributes = component.attributes | {attribute.id: attribute}
        self.load_case = load_case

    @contextmanager
    def values_of(self, load_case: LoadCase | None) -> Iterator[None]:
        """Let components have the attributes of another load case inside the block."""
        before = self.load_case
        self.take_load_case(load_case)
        try:
            yield
        finally:
            self.take_load_case(before)


def _used(
    links: Iterable[tuple[Relation, Component]], kinds: Container[str] | None = None
) -> list[Component]:
    """Components of these types (None: all); their relations are marked as used."""
    components = []
    for relation, component in links:
        if kinds is None or component.kind in kinds:
            relation.used = True
            components.append(component)
    return components


def number(components: Sequence[Component], ids: str | Iterable[str], unit: str) -> Datum | None:
    """The first of the attributes ``ids`` that any of the components states, in ``unit``; or None.

    The components stand for one part (both flanks, all planets): the first that states the
    attribute decides, and equal statements of the others are marked as used, too. Statements in a
    unit that cannot be converted stay unused.
    """
    for name in (ids,) if isinstance(ids, str) else ids:
        for k, component in enumerate(components):
            value = _converted(component, name, unit)
            if value is None:
                continue
            attribute = component.attributes[name]
            attribute.used = True
            for twin in components[k + 1 :]:
                other = _converted(twin, name, unit)
                if other is not None and math.isclose(other, value, rel_tol=SAME, abs_tol=SAME):
                    twin.attributes[name].used = True
            source = ", ".join(filter(None, (component.label, name, attribute.where)))
            return Datum(value, source)
    return None


def read(components: Sequence[Component], row: Row) -> Datum | None:
    """The key of a case in a file; None where it is not there."""
    datum = number(components, row.names, row.unit)
    return None if datum is not None and row.positive and datum.value <= 0 else datum


def mean(components: Sequence[Component], names: Iterable[str], unit: str) -> Datum | None:
    """Mean of those of the attributes that are there; None without any."""
    data = [d for name in names if (d := number(components, name, unit)) is not None]
    if not data:
        return None
    source = " and ".join(d.source for d in data) + ", mean" * (len(data) > 1)
    return Datum(sum(d.value for d in data) / len(data), source)


def value(component: Component, name: str, unit: str, default: float = 0.0) -> float:
    """An attribute as a number alone, ``default`` where it is not given."""
    datum = number([component], name, unit)
    return default if datum is None else datum.value


def text(components: Sequence[Component], name: str) -> str | None:
    """A word (enumeration, boolean, name) of the first component that has it."""
    for component in components:
        attribute = component.attributes.get(name)
        if attribute is None or not isinstance(attribute.value, str):
            continue
        attribute.used = True
        for twin in components:
            same = twin.attributes.get(name)
            if same is not None and same.value == attribute.value:
                same.used = True
        return attribute.value.strip()
    return None


def flag(components: Sequence[Component], name: str) -> bool | None:
    """A boolean, None where it is not given."""
    answer = text(components, name)
    return None if answer is None else answer.lower() in ("true", "1", "1.0")


def vector(component: Component, name: str) -> tuple[float, float, float] | None:
    """Three lengths in mm, None where they are missing."""
    attribute = component.attributes.get(name)
    if attribute is None or not isinstance(attribute.value, tuple) or len(attribute.value) != 3:
        return None
    scale = factor(attribute.unit or SCHEMA_UNITS.get(name, ""), "mm")
    try:
        x, y, z = (float(v) * (1.0 if scale is None else scale) for v in attribute.value)
    except ValueError:
        return None
    if not all(abs(v) < _LARGEST for v in (x, y, z)):
        raise InputError(
            component.label, name, f"{echo(' '.join(attribute.value))} is no place or direction",
            "export the model again",
        )  # fmt: skip
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
    try:
        value = float(attribute.value)
    except ValueError:
        return None
    return value * scale if scale is not None and abs(value) < _LARGEST else None
